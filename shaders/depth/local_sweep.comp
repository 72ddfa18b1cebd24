// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching costs of the 16 planes around each pixel's prior (prior.comp), by plane_cost.glsl.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/local_sweep.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer census;
layout(binding = 1, r32f) uniform readonly imageBuffer projections;
layout(binding = 2, r32ui) uniform readonly uimageBuffer ranges;  // prior.comp
// 16 bytes of each local pixel, the farthest plane first.
layout(binding = 3, std430) writeonly buffer Costs {
  uvec4 costs[];
};

#include "depth/local_volume.glsl"
#include "depth/plane_cost.glsl"
#include "depth/projections.glsl"

int stride_px;
vec2 size;

// Where a source sees the planes: over 16 of them, each at most a pixel from the next, the point
// moves evenly within some hundredths of a pixel, so that two divisions do for all.
struct Line {
  vec2 at;    // of the first plane, with half a pixel for rounding
  vec2 step;  // from plane to plane
};

Line LineOf(int source, vec3 p, float first, float last) {
  const vec3 a = LoadAp(source, p);
  const vec3 b = LoadB(source);
  const vec3 start = a + first * b;
  const vec3 end = a + last * b;
  const vec2 from = start.xy / start.z;
  const vec2 to = end.xy / end.z;
  const bool in_front = start.z > 0.0 && end.z > 0.0;
  return Line(in_front ? from + 0.5 : vec2(-1e6), (to - from) / float(kLocalPlanes - 1));
}

// Hamming distance, or kNoProjection.
uint Distance(Line line, float k, int first_word) {
  const vec2 at = line.at + k * line.step;
  const ivec2 pixel = ivec2(at);
  const bool visible = at.x >= 0.0 && at.y >= 0.0 && at.x < size.x && at.y < size.y;
  const int index = visible ? first_word + pixel.y * stride_px + pixel.x : 0;
  const uint distance = HammingDistance(index);
  return visible ? distance : kNoProjection;
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int height = int(params.height_px);
  if (x >= int(params.width_px) || y >= height) return;
  stride_px = 4 * (int(params.width_px + 3u) / 4);
  census_words = stride_px * height;
  size = vec2(params.width_px, params.height_px);
  LoadReference(y * stride_px + x);
  const int pixel = LocalPixel(x, y, height);
  const float range = float(imageLoad(ranges, 2 * pixel).x & 0xffffu);
  const float first = params.inverse_depth + range * params.inverse_depth_step;
  const float last = first + float(kLocalPlanes - 1) * params.inverse_depth_step;
  const vec3 p = vec3(x, y, 1);
  const Line l0 = LineOf(0, p, first, last);
  const Line l1 = LineOf(1, p, first, last);
  const Line l2 = LineOf(2, p, first, last);
  const Line l3 = LineOf(3, p, first, last);
  uvec4 words = uvec4(0);
  float k = 0.0;
  for (int i = 0; i < 4; ++i) {
    uint word = 0u;
    [[unroll]] for (int j = 0; j < 4; ++j) {
      word |= CostOf(Distance(l0, k, 2 * census_words), Distance(l1, k, 4 * census_words),
                     Distance(l2, k, 6 * census_words), Distance(l3, k, 8 * census_words))
              << (8 * j);
      k += 1.0;
    }
    words = uvec4(words.yzw, word);
  }
  costs[pixel] = words;
}
