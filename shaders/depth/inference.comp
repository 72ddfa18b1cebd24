// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Inverse depth of pixels that were not matched to the end, from the surface around: at full
// resolution the state is the mean of the four pixels of half the resolution around, weighted by
// distance and likeness of grey values. It is believed where planes that won the sweep, though not
// clearly enough to be an estimate, are near: that of the second nearest of five pixels around
// counts; or where it is that of a plane that is believed as a whole, or near what was matched on a
// coarser level; and where enough sources see it. Confidence falls with the distance from it, and
// is never above kMostConfidence. No estimate elsewhere, and in the sky. One pixel an invocation; a
// quarter of a tile is a workgroup.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/inference.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, r32f) uniform readonly imageBuffer depth;       // su; 0: was not matched
layout(binding = 1, r32f) uniform readonly imageBuffer winners;     // fine_winner.glsl
layout(binding = 2, rgba32f) uniform readonly imageBuffer state;    // half resolution
layout(binding = 3, rgba32ui) uniform readonly uimageBuffer image;  // padded, full resolution
layout(binding = 4, rgba32f) uniform readonly imageBuffer cells;    // inference.glsl
layout(binding = 5, rgba32f) uniform readonly imageBuffer projections;  // projections.glsl
layout(binding = 6, r32ui) uniform readonly uimageBuffer tiles;  // inference_tiles.glsl
// Only what is inferred is written.
layout(binding = 7, std430) writeonly buffer InverseDepth {  // 1/su
  float inverse_depth[];
};
layout(binding = 8, std430) writeonly buffer Confidence {  // negative: matched on a coarser level
  float confidence[];
};

#include "depth/inference.glsl"
#include "depth/inference_tiles.glsl"
#include "depth/projections.glsl"
#include "depth/sources.glsl"
#define WORDS image
#include "depth/three_words.glsl"

const float kMostConfidence = 0.125;
const int kReach = 2;  // px
const float kNone = 3e38;
const float kLeastConfidence = 0.004;  // a step of 8 bits, as which depth maps may be kept

// The second least of five; pixels outside the image, and those that no source sees, have none.
float DifferenceFromWinners(int x, int y, float w) {
  const int level = int(params.winner_level);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  float least = kNone;
  float second = kNone;
  [[unroll]] for (int i = 0; i < 5; ++i) {
    const int column = x + (i == 1 ? -kReach : (i == 2 ? kReach : 0));
    const int row = y + (i == 3 ? -kReach : (i == 4 ? kReach : 0));
    const bool inside = column >= 0 && column < width && row >= 0 && row < height;
    const int at = (row >> level) * int(params.winner_width_px) + (column >> level);
    const float winner = abs(imageLoad(winners, inside ? at : 0).x);
    const float difference = inside && winner > 0.0 ? abs(w - winner) : kNone;
    second = min(second, max(least, difference));
    least = min(least, difference);
  }
  return second;
}

float NumViews(int x, int y, float w) {
  float num_views = 0.0;
  [[unroll]] for (int s = 0; s < kNumSources; ++s) {
    const Projection projection = LoadProjection(s);
    const vec3 at = projection.A * vec3(x, y, 1) + w * projection.b;
    const vec4 bounds = at.z * projection.bounds;
    const bool visible = at.z > 0.0 && at.x >= bounds.x && at.y >= bounds.y && at.x < bounds.z &&
                         at.y < bounds.w;
    num_views += visible ? 1.0 : 0.0;
  }
  return num_views;
}

void main() {
  const ivec2 corner = TileCorner(params.width_px);
  const int local = int(gl_LocalInvocationID.x);
  const int x = corner.x + (local & (kTileWidth - 1));
  const int y = corner.y + 2 * int(gl_WorkGroupID.z) + local / kTileWidth;
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  const int pixel = y * int(params.width_px) + x;
  const int half_width = int(params.width_px + 1u) / 2;
  const int half_height = int(params.height_px + 1u) / 2;
  const int word = PaddedWordIndex(int(PaddedWordsPerRow(params.width_px)), x >> 2, y);
  const float grey =
      float((CutWord(imageLoad(image, word >> 2), word) >> (8 * (x & 3))) & 0xffu);
  const int side_x = (x & 1) != 0 ? 1 : -1;
  const int side_y = (y & 1) != 0 ? 1 : -1;
  vec3 sums = vec3(0);  // of inverse depths, confidences and weights
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int column = clamp((x >> 1) + (i & 1) * side_x, 0, half_width - 1);
    const int row = clamp((y >> 1) + (i >> 1) * side_y, 0, half_height - 1);
    const vec4 one = imageLoad(state, row * half_width + column);
    const float weight = ((i & 1) != 0 ? 0.25 : 0.75) * ((i >> 1) != 0 ? 0.25 : 0.75) *
                         Conductance(grey, one.z);
    sums += weight * vec3(one.xy, 1.0);
  }
  const float w = sums.x / sums.z;
  const vec4 cell = imageLoad(cells, CellAt(x, y, params.width_px));
  const float from_winners = DifferenceFromWinners(x, y, w) / params.inverse_depth_step;
  const float difference = IsBelieved(cell) ? min(from_winners, 1.0) : from_winners;
  const float matched = imageLoad(depth, pixel).x;
  if (matched > 0.0 || w <= 0.0 || cell.w < 0.0 || !ReferenceShows(vec2(x, y))) return;
  const float num_views = NumViews(x, y, w);
  const bool is_guess = difference <= params.max_difference && num_views >= params.min_views;
  const float from_coarse = IsMatchedCoarsely(cell) ? abs(w - cell.x) / cell.y : kNone;
  const bool is_coarse =
      from_coarse <= params.max_difference && num_views >= params.min_coarse_views;
  if (!is_guess && !is_coarse) return;
  inverse_depth[pixel] = w;
  const float guessed = is_guess ? sums.y / sums.z / (1.0 + difference * difference) : 0.0;
  const float coarsely = is_coarse ? cell.z / (1.0 + from_coarse * from_coarse) : 0.0;
  const float surer = clamp(max(guessed, coarsely), kLeastConfidence, kMostConfidence);
  confidence[pixel] = is_coarse ? -surer : surer;
}
