// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One step (Jacobi's) towards the surface that is nearest to the data and smooth: the minimum of
// the sum of weight * (w - target)^2 over the pixels and of conductance * (w - w')^2 over the pairs
// of neighbours. In between data it is harmonic, so that a plane, whose inverse depth is affine in
// the pixel, is completed as a plane. Confidence spreads the same way, and leaks. One pixel an
// invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/inference_relax.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform readonly imageBuffer data;    // inference.glsl
layout(binding = 1, rgba32f) uniform readonly imageBuffer before;  // state
layout(binding = 2, std430) writeonly buffer After {
  vec4 after[];
};

#include "depth/inference.glsl"

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;
  const int pixel = y * width + x;
  const vec4 own = imageLoad(data, pixel);
  vec3 sums = own.y * vec3(own.x, own.z, 1.0);  // of inverse depths, confidences and weights
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int column = x + (i == 0 ? -1 : (i == 1 ? 1 : 0));
    const int row = y + (i == 2 ? -1 : (i == 3 ? 1 : 0));
    const bool inside = column >= 0 && column < width && row >= 0 && row < height;
    const vec4 other = imageLoad(before, inside ? row * width + column : pixel);
    const float weight = inside ? Conductance(own.w, other.z) : 0.0;
    sums += weight * vec3(other.xy, 1.0);
  }
  after[pixel] = vec4(sums.z > 0.0 ? sums.x / sums.z : 0.0, sums.y / (sums.z + params.leak), own.w,
                      0.0);
}
