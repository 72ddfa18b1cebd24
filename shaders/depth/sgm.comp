// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Semi-global matching (Hirschmueller 2008, eq. 13), one path direction: the costs along the path
//   L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min L(q) + P2) - min L(q),  q = p - step,
// added to the sums over the directions. One subgroup a scanline, the planes spread over its lanes.
// Diagonal scanlines wrap around at the left and right border and start anew there, so that all
// take the same number of steps.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_shuffle_relative : require

#include "depth/padded_image.glsl"
#include "depth/sgm.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const int kLanes = 8;           // subgroup size
layout(constant_id = 1) const int kPlanesPerLane = 16;  // multiple of 4

layout(binding = 0, r32ui) uniform readonly uimageBuffer costs;  // plane_sweep.comp, in words
layout(binding = 1, r32ui) uniform readonly uimageBuffer image;  // padded grey image, the first
layout(binding = 2, r32ui) uniform readonly uimageBuffer p2;     // by difference of grey values, 256
layout(binding = 3, r32ui) uniform readonly uimageBuffer sums_before;  // the memory of `sums`
layout(binding = 4, std430) writeonly buffer Sums {  // two planes a word, 16 bits each
  uvec2 sums[];
};

const uint kUnreachable = 0xffffu;

uint Grey(int x, int y, int words_per_row) {
  const uint word = imageLoad(image, PaddedWordIndex(words_per_row, x >> 2, y)).x;
  return (word >> (8 * (x & 3))) & 0xffu;
}

void main() {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  const int words_per_row = int(PaddedWordsPerRow(params.width_px));
  const int lane = int(gl_GlobalInvocationID.x) % kLanes;
  const int scanline = int(gl_GlobalInvocationID.x) / kLanes;
  const bool is_row = params.step_y == 0;
  if (scanline >= (is_row ? height : width)) return;  // whole subgroups
  const int num_steps = is_row ? width : height;
  int x = is_row ? (params.step_x > 0 ? 0 : width - 1) : scanline;
  int y = is_row ? scanline : (params.step_y > 0 ? 0 : height - 1);

  uint path[kPlanesPerLane];
  [[unroll]] for (int i = 0; i < kPlanesPerLane; ++i) path[i] = 0u;
  uint minimum = 0u;
  uint grey_before = Grey(x, y, words_per_row);
  for (int step = 0; step < num_steps; ++step) {
    const uint grey = Grey(x, y, words_per_row);
    const uint jump = minimum + imageLoad(p2, int(max(grey, grey_before) - min(grey, grey_before))).x;
    grey_before = grey;
    uint below = subgroupShuffleUp(path[kPlanesPerLane - 1], 1u);
    if (lane == 0) below = kUnreachable;
    uint above_last = subgroupShuffleDown(path[0], 1u);
    if (lane == kLanes - 1) above_last = kUnreachable;
    const int first_word = ((y * width + x) * kLanes + lane) * (kPlanesPerLane / 4);
    uint least = kUnreachable;
    [[unroll]] for (int w = 0; w < kPlanesPerLane / 4; ++w) {
      const uint cost_word = imageLoad(costs, first_word + w).x;
      [[unroll]] for (int j = 0; j < 4; ++j) {
        const int i = 4 * w + j;
        const uint above = i + 1 < kPlanesPerLane ? path[min(i + 1, kPlanesPerLane - 1)] : above_last;
        const uint here = path[i];
        const uint best = min(min(here, jump), min(below, above) + params.p1);
        below = here;
        path[i] = ((cost_word >> (8 * j)) & 0xffu) + best - minimum;
        least = min(least, path[i]);
      }
      uvec2 sum = uvec2(path[4 * w] | (path[4 * w + 1] << 16),
                        path[4 * w + 2] | (path[4 * w + 3] << 16));
      const int sum_word = 2 * (first_word + w);
      if (params.is_first == 0u) {
        sum += uvec2(imageLoad(sums_before, sum_word).x, imageLoad(sums_before, sum_word + 1).x);
      }
      sums[first_word + w] = sum;
    }
    [[unroll]] for (int distance = 1; distance < kLanes; distance *= 2) {
      least = min(least, subgroupShuffleXor(least, uint(distance)));
    }
    minimum = least;

    x += params.step_x;
    y += params.step_y;
    if (!is_row && (x < 0 || x >= width)) {
      x += x < 0 ? width : -width;
      [[unroll]] for (int i = 0; i < kPlanesPerLane; ++i) path[i] = 0u;
      minimum = 0u;
    }
  }
}
