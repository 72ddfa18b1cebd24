// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching costs of the 16 planes around each pixel's prior (prior.comp), or of the 8 in the middle
// where its range is narrow. Combined as in plane_cost.glsl, from the words of fine_census.comp: a
// cost is four times the mean distance, 0 to 128.
//
// The 2x2 pixels of a block have one range and are projected together, by the middle of the block;
// between images turned by 10 degrees against each other the error of that is 0.12 px. Eight blocks
// in a column are one invocation and share the projections.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require

#include "depth/fine_sweep.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rg32ui) uniform readonly uimageBuffer census;  // fine_census.comp
layout(binding = 1, rgba32f) uniform readonly imageBuffer projections;
layout(binding = 2, rg32ui) uniform readonly uimageBuffer ranges;  // prior.comp
// 16 bytes of each pixel, in the order of fine_volume.glsl, the farthest plane first.
layout(binding = 3, std430) writeonly buffer Costs {
  uvec4 costs[];
};

#include "depth/fine_census.glsl"
#include "depth/fine_volume.glsl"
#include "depth/projections.glsl"
#include "depth/sources.glsl"

// Is any picture turned? Where none is the words need no turning.
layout(constant_id = 2) const bool kWithTurns = false;

const int kBlocksPerInvocation = 8;  // as kernels.cpp dispatches

const uint kInvalidCost = 255u;
#include "depth/both_sides.glsl"
const uint kNotMatched = 0xffffffffu;  // four planes of kInvalidCost

int texels_per_row, image_texels;
vec4 bounds[kMaxSources];

// Where a source sees the planes: over 16 of them, each at most a pixel from the next, the point
// moves evenly within some hundredths of a pixel, so that two divisions do for all.
struct Line {
  vec2 at;    // of the first plane
  vec2 step;  // from plane to plane
};

// A p of a source in the first block, its change from row to row, and b.
struct Source {
  vec3 a, row, b;
  vec4 bounds;
};

Source LoadSource(int source, vec3 p) {
  const Projection projection = LoadProjection(source);
  return Source(projection.A * p, projection.A[1], projection.b, projection.bounds);
}

Line LineOf(Source source, float row, float first, float last, bool shown) {
  const vec3 a = source.a + row * source.row;
  const vec3 start = a + first * source.b;
  const vec3 end = a + last * source.b;
  const vec2 from = start.xy / start.z;
  const vec2 to = end.xy / end.z;
  const bool in_front = shown && start.z > 0.0 && end.z > 0.0;
  return Line(in_front ? from : vec2(-1e6), (to - from) / float(kFinePlanes - 1));
}

// The sums of the distances over one side's sources that see the block, and how many they are.
struct Side {
  uvec4 sums;  // of the four pixels
  uint num_visible;
};

// The words of a block of a source, top left, top right, bottom left and bottom right, in the order
// of the reference's pixels that they show.
uvec4 InOrderOfReference(uvec4 words, int source) {
  const uint quarter_turns = (params.quarter_turns >> (2 * (source + 1))) & 3u;
  words = (quarter_turns & 1u) != 0u ? words.ywxz : words;
  return quarter_turns >= 2u ? words.wzyx : words;
}

void AddSource(inout Side side, int source, vec2 at, uvec4 reference) {
  const vec4 limits = bounds[source];
  const bool visible =
      at.x >= limits.x && at.y >= limits.y && at.x < limits.z && at.y < limits.w;
  const ivec2 corner = visible ? ivec2(at) : ivec2(0);
  const int texel = kFirstFineCensusTexel + (source + 1) * image_texels +
                    corner.y * texels_per_row + corner.x;
  uvec4 words = uvec4(imageLoad(census, texel).xy, imageLoad(census, texel + texels_per_row).xy);
  if (kWithTurns) words = InOrderOfReference(words, source);
  const uvec4 distances = uvec4(bitCount(words ^ reference));
  side.sums += visible ? distances : uvec4(0);
  side.num_visible += visible ? 1u : 0u;
}

uvec4 SideCosts(Side side) {
  const uvec4 costs =
      kSourcesPerSide <= 2
          ? side.sums << (side.num_visible == 2u ? 1 : 2)
          : uvec4(vec4(side.sums) * (4.0 / float(max(side.num_visible, 1u))) + 0.5);
  return side.num_visible > 0u ? costs : uvec4(kInvalidCost);
}

// Of the four pixels on the next plane.
uvec4 NextCosts(inout Line lines[kMaxSources], uvec4 reference) {
  Side before = Side(uvec4(0), 0u);
  Side after = Side(uvec4(0), 0u);
  [[unroll]] for (int s = 0; s < kSourcesPerSide; ++s) {
    AddSource(before, s, lines[s].at, reference);
    AddSource(after, s + kSourcesPerSide, lines[s + kSourcesPerSide].at, reference);
  }
  [[unroll]] for (int s = 0; s < kNumSources; ++s) lines[s].at += lines[s].step;
  return BothSides(SideCosts(before), SideCosts(after));
}

void StoreCosts(uvec4 words, bool narrow, int x, int y) {
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  costs[FinePixel(x, y, int(params.height_px))] =
      narrow ? uvec4(kNotMatched, words.zw, kNotMatched) : words;
}

void MatchBlock(Source sources[kMaxSources], int x, int y, float row) {
  const int texel = kFirstFineCensusTexel + y * texels_per_row + x;
  const int texel_below = texel + (y + 1 < int(params.height_px) ? texels_per_row : 0);
  const uvec4 reference = uvec4(imageLoad(census, texel).xy, imageLoad(census, texel_below).xy);
  const uint range = imageLoad(ranges, FinePixel(x, y, int(params.height_px))).x;
  const bool narrow = (range & kNarrow) != 0u;
  const float first_plane = float(range & 0xffffu) + (narrow ? 4.0 : 0.0);
  const float first = params.inverse_depth + first_plane * params.inverse_depth_step;
  const float last = first + float(kFinePlanes - 1) * params.inverse_depth_step;
  Line lines[kMaxSources];
  const bool shown = ReferenceShows(vec2(x, y));
  [[unroll]] for (int s = 0; s < kNumSources; ++s) {
    lines[s] = LineOf(sources[s], row, first, last, shown);
  }
  uvec4 words[4] = uvec4[](uvec4(0), uvec4(0), uvec4(0), uvec4(0));  // of each pixel
  // As many for all lanes, since the software driver keeps what is used after a loop only of lanes
  // that leave it together. And the test is at the end: what comes after a test at the start is
  // run once more there, for no lane.
  const int num_words = subgroupAny(!narrow) ? 4 : 2;
  for (int word = 0;;) {
    uvec4 bytes = uvec4(0);
    [[unroll]] for (int i = 0; i < 4; ++i) bytes |= NextCosts(lines, reference) << (8 * i);
    const bool wanted = word < 2 || !narrow;
    [[unroll]] for (int i = 0; i < 4; ++i) {
      words[i] = wanted ? uvec4(words[i].yzw, bytes[i]) : words[i];
    }
    if (++word >= num_words) break;
  }
  StoreCosts(words[0], narrow, x, y);
  StoreCosts(words[1], narrow, x + 1, y);
  StoreCosts(words[2], narrow, x, y + 1);
  StoreCosts(words[3], narrow, x + 1, y + 1);
}

void main() {
  const int x = 2 * int(gl_GlobalInvocationID.x);
  const int first_row = 2 * kBlocksPerInvocation * int(gl_GlobalInvocationID.y);
  const int height = int(params.height_px);
  if (x >= int(params.width_px) || first_row >= height) return;
  texels_per_row = FineCensusTexelsPerRow(params.width_px);
  image_texels = FineCensusTexels(params.width_px, params.height_px);
  const vec3 p = vec3(float(x) + 0.5, float(first_row) + 0.5, 1);
  Source sources[kMaxSources];
  [[unroll]] for (int s = 0; s < kNumSources; ++s) {
    sources[s] = LoadSource(s, p);
    bounds[s] = sources[s].bounds;
  }
  const int num_rows = min(2 * kBlocksPerInvocation, height - first_row);
  for (int row = 0;;) {
    MatchBlock(sources, x, first_row + row, float(row));
    row += 2;
    if (row >= num_rows) break;
  }
}
