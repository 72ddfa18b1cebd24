// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The state of a level to begin with: that of the next coarser one, bilinear. One pixel an
// invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/inference_expand.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform readonly imageBuffer coarse;  // state of inference.glsl
layout(binding = 1, rgba32f) uniform readonly imageBuffer data;    // of this level
layout(binding = 2, std430) writeonly buffer State {
  vec4 state[];
};

vec2 Coarse(int x, int y) {
  const int column = clamp(x, 0, int(params.coarse_width_px) - 1);
  const int row = clamp(y, 0, int(params.coarse_height_px) - 1);
  return imageLoad(coarse, row * int(params.coarse_width_px) + column).xy;
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  // A fine pixel's centre lies a quarter of a coarse pixel from that of its own coarse one.
  const int near_x = x >> 1, near_y = y >> 1;
  const int far_x = near_x + ((x & 1) != 0 ? 1 : -1);
  const int far_y = near_y + ((y & 1) != 0 ? 1 : -1);
  const vec2 value = 0.5625 * Coarse(near_x, near_y) + 0.1875 * Coarse(far_x, near_y) +
                     0.1875 * Coarse(near_x, far_y) + 0.0625 * Coarse(far_x, far_y);
  const int pixel = y * int(params.width_px) + x;
  state[pixel] = vec4(value, imageLoad(data, pixel).w, 0.0);
}
