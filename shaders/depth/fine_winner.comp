// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Of the 16 planes of each pixel that of the smallest sum over the paths, the first of equals,
// and between the planes the lowest point of the parabola through its neighbours; at an end of the
// range the plane itself. No estimate where the plane does not match, and where another one, not
// next to it, is nearly as good: the inverse depth is then negative, for the inference of surfaces,
// or 0 where no source sees the plane. One pixel an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/fine_winner.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kEightPaths = true;  // else those of `paths` alone
layout(constant_id = 1) const bool kSubPlane = true;    // else the plane itself

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer paths;       // four of fine_sgm.comp
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer more_paths;  // the other four
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer costs;       // fine_sweep.comp
layout(binding = 3, rg32ui) uniform readonly uimageBuffer ranges;         // prior.comp
layout(binding = 4, std430) writeonly buffer InverseDepth {  // 1/su; 0 or less: no estimate
  float inverse_depth[];
};
layout(binding = 5, std430) writeonly buffer Uniqueness {  // 0 to 1: 1 - smallest / runner-up
  float uniqueness[];
};

#include "depth/fine_volume.glsl"

const uint kMax = 0xffffffffu;
const uint kUnseen = 255u;  // the cost of a plane that no source sees

void main() {
  // In the order of the volumes: eight of them are read at once.
  const int height = int(params.height_px);
  const int y = int(gl_GlobalInvocationID.x) >> 3;
  const int x = int(gl_GlobalInvocationID.y << 3) | (int(gl_GlobalInvocationID.x) & 7);
  if (x >= int(params.width_px) || y >= height) return;
  const int pixel = FinePixel(x, y, height);
  const int volume = FinePixel(int(params.width_px + 7u) & ~7, 0, height);

  uvec4 even = uvec4(0);  // sums of planes 4 i and 4 i + 2, 16 bits each
  uvec4 odd = uvec4(0);
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const uvec4 one = imageLoad(paths, i * volume + pixel);
    even += one & 0x00ff00ffu;
    odd += (one >> 8) & 0x00ff00ffu;
    if (kEightPaths) {
      const uvec4 other = imageLoad(more_paths, i * volume + pixel);
      even += other & 0x00ff00ffu;
      odd += (other >> 8) & 0x00ff00ffu;
    }
  }
  uint sums[16];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    sums[4 * i] = even[i] & 0xffffu;
    sums[4 * i + 1] = odd[i] & 0xffffu;
    sums[4 * i + 2] = even[i] >> 16;
    sums[4 * i + 3] = odd[i] >> 16;
  }
  uint best_key = kMax;  // sum and plane, ordered by sum first
  [[unroll]] for (int d = 0; d < 16; ++d) best_key = min(best_key, (sums[d] << 8) | uint(d));
  const int best = int(best_key & 0xffu);
  const uvec4 cost_words = imageLoad(costs, pixel);
  uint below = 0u, above = 0u, cost = 0u, second = kMax;
  [[unroll]] for (int d = 0; d < 16; ++d) {
    below = d + 1 == best ? sums[d] : below;
    above = d - 1 == best ? sums[d] : above;
    cost = d == best ? (cost_words[d / 4] >> (8 * (d % 4))) & 0xffu : cost;
    second = min(second, abs(d - best) > 1 ? sums[d] : kMax);
  }
  const uint here = best_key >> 8;
  const float share = second > 0u ? 1.0 - float(here) / float(second) : 0.0;
  const float curvature = float(below) - 2.0 * float(here) + float(above);
  const bool inside = kSubPlane && best > 0 && best < 15 && curvature > 0.0;
  const float offset = inside ? 0.5 * (float(below) - float(above)) / curvature : 0.0;
  const float plane = float((imageLoad(ranges, pixel).x & 0xffffu) + uint(best)) + offset;
  const float w = params.inverse_depth + plane * params.inverse_depth_step;
  const bool valid = cost <= params.max_cost && share >= params.min_uniqueness;
  const float result = valid ? w : (cost < kUnseen ? -w : 0.0);
  const int index = y * int(params.width_px) + x;
  inverse_depth[index] = result;
  uniqueness[index] = result > 0.0 ? share : 0.0;
}
