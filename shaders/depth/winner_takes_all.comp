// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The plane of the smallest sum, the first of equals, and between the planes the lowest point of
// the parabola through its neighbours. No estimate on the first and last plane, where the parabola
// has no support and the true depth may lie outside; where the plane does not match; and where
// another plane, not next to it, is nearly as good. One pixel an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/winner_takes_all.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kSubPlane = true;  // else the plane itself

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer sums;  // sgm.comp, eight planes a texel
layout(binding = 1, r32ui) uniform readonly uimageBuffer costs;    // plane_sweep.comp
layout(binding = 2, std430) writeonly buffer InverseDepth {  // 1/su; 0: no estimate
  float inverse_depth[];
};
layout(binding = 3, std430) writeonly buffer Uniqueness {  // 0 to 1: 1 - smallest / runner-up
  float uniqueness[];
};

// A sum and its plane in one number, ordered by sum first.
uint Key(uint sum, uint plane) { return (sum << 16) | plane; }

uint FarKey(uint sum, uint plane, uint best) {
  return abs(int(plane) - int(best)) > 1 ? Key(sum, plane) : 0xffffffffu;
}

uint Sum(int first_texel, uint plane) {
  const uvec4 texel = imageLoad(sums, first_texel + int(plane >> 3));
  const uint half_index = (plane >> 1) & 3u;
  const uint word = half_index == 0u   ? texel.x
                    : half_index == 1u ? texel.y
                    : half_index == 2u ? texel.z
                                       : texel.w;
  return (word >> (16u * (plane & 1u))) & 0xffffu;
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  const int pixel = y * int(params.width_px) + x;
  const int num_texels = int(params.padded_planes / 8u);
  const int first_texel = pixel * num_texels;

  uint best_key = 0xffffffffu;
  for (int t = 0;;) {
    const uvec4 texel = imageLoad(sums, first_texel + t);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      const uint plane = uint(8 * t + 2 * i);
      best_key = min(best_key, min(Key(texel[i] & 0xffffu, plane), Key(texel[i] >> 16, plane + 1u)));
    }
    if (++t >= num_texels) break;  // at the end: see fine_sweep.comp
  }
  const uint best = best_key & 0xffffu;
  uint second_key = 0xffffffffu;
  for (int t = 0;;) {
    const uvec4 texel = imageLoad(sums, first_texel + t);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      const uint plane = uint(8 * t + 2 * i);
      second_key = min(second_key, min(FarKey(texel[i] & 0xffffu, plane, best),
                                       FarKey(texel[i] >> 16, plane + 1u, best)));
    }
    if (++t >= num_texels) break;
  }

  const uint cost_word = imageLoad(costs, pixel * 2 * num_texels + int(best >> 2)).x;
  const uint cost = (cost_word >> (8u * (best & 3u))) & 0xffu;
  const float here = float(best_key >> 16);
  const float second = float(second_key >> 16);
  const float share = second > 0.0 ? 1.0 - here / second : 0.0;
  float result = 0.0;
  if (best > 0u && best + 1u < params.num_planes && cost <= params.max_cost &&
      share >= params.min_uniqueness) {
    const float below = float(Sum(first_texel, best - 1u));
    const float above = float(Sum(first_texel, best + 1u));
    const float curvature = below - 2.0 * here + above;
    const float offset = kSubPlane && curvature > 0.0 ? 0.5 * (below - above) / curvature : 0.0;
    result = params.inverse_depth + (float(best) + offset) * params.inverse_depth_step;
  }
  inverse_depth[pixel] = result;
  uniqueness[pixel] = result > 0.0 ? share : 0.0;
}
