// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Data of half the size, rounded up: the weighted means of 2x2 pixels, the sum of their weights,
// the mean of their grey values. One coarse pixel an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/inference_halve.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform readonly imageBuffer fine;  // data of inference.glsl
layout(binding = 1, std430) writeonly buffer Coarse {
  vec4 coarse[];
};

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.fine_width_px + 1u) / 2;
  const int height = int(params.fine_height_px + 1u) / 2;
  if (x >= width || y >= height) return;
  vec4 sums = vec4(0);  // as the data, but not yet divided
  float count = 0.0;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int column = 2 * x + (i & 1);
    const int row = 2 * y + (i >> 1);
    if (column < int(params.fine_width_px) && row < int(params.fine_height_px)) {
      const vec4 one = imageLoad(fine, row * int(params.fine_width_px) + column);
      sums += vec4(one.y * one.x, one.y, one.y * one.z, one.w);
      count += 1.0;
    }
  }
  const float share = sums.y > 0.0 ? 1.0 / sums.y : 0.0;
  coarse[y * width + x] = vec4(share * sums.x, sums.y, share * sums.z, sums.w / count);
}
