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
// 16 bytes of each pixel, the farthest plane first; rows of stride_px pixels.
layout(binding = 3, std430) writeonly buffer Costs {
  uvec4 costs[];
};

#include "depth/plane_cost.glsl"

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  PreparePixel(x, y, params.width_px, params.height_px, 1u);
  const int pixel = y * int(params.stride_px) + x;
  const float first_inverse_depth = params.inverse_depth;
  const float inverse_depth_step = params.inverse_depth_step;
  float k = float(imageLoad(ranges, pixel).x & 0xffffu);
  uvec4 words = uvec4(0);
  for (int i = 0; i < 4; ++i) {
    uint word = 0u;
    [[unroll]] for (int j = 0; j < 4; ++j) {
      word |= Cost(first_inverse_depth + k * inverse_depth_step) << (8 * j);
      k += 1.0;
    }
    words = uvec4(words.yzw, word);
  }
  costs[pixel] = words;
}
