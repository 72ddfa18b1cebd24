// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching costs of the 16 planes around each pixel's prior (prior.comp), or of the 8 in the middle
// where its range is narrow, by plane_cost.glsl. Four rows an invocation, which share the projections.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/local_sweep.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rg32ui) uniform readonly uimageBuffer census;
layout(binding = 1, r32f) uniform readonly imageBuffer projections;
layout(binding = 2, rg32ui) uniform readonly uimageBuffer ranges;  // prior.comp
// 16 bytes of each local pixel, the farthest plane first.
layout(binding = 3, std430) writeonly buffer Costs {
  uvec4 costs[];
};

#include "depth/local_volume.glsl"
#include "depth/sources.glsl"
#include "depth/plane_cost.glsl"
#include "depth/projections.glsl"

const int kRowsPerInvocation = 4;  // as local_sweep.cpp dispatches

const uint kNotMatched = 0xffffffffu;  // four planes of kInvalidCost

int stride_px;
vec2 size;

// Where a source sees the planes: over 16 of them, each at most a pixel from the next, the point
// moves evenly within some hundredths of a pixel, so that two divisions do for all.
struct Line {
  vec2 at;    // of the first plane, with half a pixel for rounding
  vec2 step;  // from plane to plane
};

// A p of a source in the first row, its change from row to row, and b.
struct Source {
  vec3 a, row, b;
};

Source LoadSource(int source, vec3 p) {
  return Source(LoadAp(source, p), LoadVector(12 * source + 1, 3), LoadB(source));
}

Line LineOf(Source source, float row, float first, float last) {
  const vec3 a = source.a + row * source.row;
  const vec3 start = a + first * source.b;
  const vec3 end = a + last * source.b;
  const vec2 from = start.xy / start.z;
  const vec2 to = end.xy / end.z;
  const bool in_front = start.z > 0.0 && end.z > 0.0;
  return Line(in_front ? from + 0.5 : vec2(-1e6), (to - from) / float(kLocalPlanes - 1));
}

// At line.at, which moves on to the next plane.
View NextView(int source, inout Line line) {
  const vec2 at = line.at;
  line.at += line.step;
  const ivec2 pixel = ivec2(at);
  const bool visible = at.x >= 0.0 && at.y >= 0.0 && at.x < size.x && at.y < size.y;
  return ViewOf(visible, (source + 1) * census_pixels + pixel.y * stride_px + pixel.x);
}

void MatchPixel(Source sources[kMostSources], int x, int y, float row) {
  LoadReference(y * stride_px + x);
  const int pixel = LocalPixel(x, y, int(params.height_px));
  const uint range = imageLoad(ranges, pixel).x;
  const bool narrow = (range & kNarrow) != 0u;
  const float first_plane = float(range & 0xffffu) + (narrow ? 4.0 : 0.0);
  const float first = params.inverse_depth + first_plane * params.inverse_depth_step;
  const float last = first + float(kLocalPlanes - 1) * params.inverse_depth_step;
  Line lines[kMostSources];
  [[unroll]] for (int s = 0; s < kNumSources; ++s) lines[s] = LineOf(sources[s], row, first, last);
  uvec4 words = uvec4(0);
  const int num_words = narrow ? 2 : 4;
  for (int i = 0; i < num_words; ++i) {
    uint word = 0u;
    [[unroll]] for (int j = 0; j < 4; ++j) {
      View views[kMostSources];
      [[unroll]] for (int s = 0; s < kNumSources; ++s) views[s] = NextView(s, lines[s]);
      word |= CostOf(views) << (8 * j);
    }
    words = uvec4(words.yzw, word);
  }
  costs[pixel] = narrow ? uvec4(kNotMatched, words.zw, kNotMatched) : words;
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int first_row = kRowsPerInvocation * int(gl_GlobalInvocationID.y);
  const int height = int(params.height_px);
  if (x >= int(params.width_px) || first_row >= height) return;
  stride_px = 4 * (int(params.width_px + 3u) / 4);
  census_pixels = stride_px * height;
  size = vec2(params.width_px, params.height_px);
  const vec3 p = vec3(x, first_row, 1);
  Source sources[kMostSources];
  [[unroll]] for (int s = 0; s < kNumSources; ++s) sources[s] = LoadSource(s, p);
  const int num_rows = min(kRowsPerInvocation, height - first_row);
  for (int row = 0; row < num_rows; ++row) {
    MatchPixel(sources, x, first_row + row, float(row));
  }
}
