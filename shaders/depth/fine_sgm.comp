// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Semi-global matching over per-pixel ranges of 16 planes, one path direction:
//   L(p, d) = min(255, C(p, d) + min(L'(q, d'), L'(q, d' +- 1) + P1, P2)),  q = p - step,
// where d' is the plane of q on p's surface (SGM^sn) and L' = L - min L. From planes that q was not
// matched on, the only way is a jump, P2. One invocation a scanline; the path is held as bytes, so
// that a change of range is a shift of bytes. The last direction does not store its path but finds
// the winner of each pixel by the sum over all. Diagonal scanlines wrap around at the left and right
// border and start anew there, so that all take the same number of steps.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/fine_sgm.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const int kPathsBefore = 0;   // of the last direction: 3 or 7, else 0
layout(constant_id = 1) const bool kSubPlane = true;  // fine_winner.glsl

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer costs;  // fine_sweep.comp
layout(binding = 1, rg32ui) uniform readonly uimageBuffer ranges;   // prior.comp
// Of the last direction: the paths of the first four directions and of the other four.
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer first_paths;
layout(binding = 3, rgba32ui) uniform readonly uimageBuffer more_paths;
// Of the others: L as bytes, a texel of 16 a pixel as the costs; the volumes of directions one
// after the other.
layout(binding = 4, std430) writeonly buffer Paths {
  uvec4 paths[];
};
// Of the last direction, in rows without padding.
layout(binding = 5, std430) writeonly buffer InverseDepth {  // 1/su; 0 or less: no estimate
  float inverse_depth[];
};
layout(binding = 6, std430) writeonly buffer Uniqueness {  // 0 to 1
  float uniqueness[];
};

#include "depth/fine_volume.glsl"
#include "depth/fine_winner.glsl"

const uint kNone = 0xffffffffu;  // four planes that the pixel before was not matched on

#define SELECT(condition, a, b) ((condition) ? (a) : (b))

// Bytes `first` to `first` + 17 of the path's 16, in five words; first in -18 .. 16.
void ShiftBytes(uvec4 path, int first, out uint v[5]) {
  const int n = (first >> 2) + 5;  // 0 .. 9: the first of 15 words, of which 5 .. 8 are the path
  const bool by8 = (n & 8) != 0, by4 = (n & 4) != 0, by2 = (n & 2) != 0, by1 = (n & 1) != 0;
  uint a[13];
  [[unroll]] for (int i = 0; i < 13; ++i) {
    const uint far = i == 0 ? path.w : kNone;
    const uint near = i >= 5 && i <= 8 ? path[clamp(i - 5, 0, 3)] : kNone;
    a[i] = SELECT(by8, far, near);
  }
  uint b[9];
  [[unroll]] for (int i = 0; i < 9; ++i) b[i] = SELECT(by4, a[i + 4], a[i]);
  uint c[7];
  [[unroll]] for (int i = 0; i < 7; ++i) c[i] = SELECT(by2, b[i + 2], b[i]);
  uint d[6];
  [[unroll]] for (int i = 0; i < 6; ++i) d[i] = SELECT(by1, c[i + 1], c[i]);
  const uint bits = 8u * uint(first & 3);
  [[unroll]] for (int i = 0; i < 5; ++i) {
    v[i] = (d[i] >> bits) | ((d[i + 1] << (31u - bits)) << 1);
  }
}

// P2 between pixels whose grey values differ by so much; what is added keeps quotients that are
// whole numbers from being rounded to one less: others are 1/510 or more below one.
uint JumpPenalty(int difference) {
  const float falling = params.p2_times_gradient / (params.gradient + float(difference)) + 5e-4;
  return max(uint(falling), params.min_p2);
}

void main() {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  const int step_x = params.step_x;
  const int step_y = params.step_y;
  const uint p1 = params.p1;
  const int jump_shift = 4 * int(params.direction);
  const int first_texel = int(params.first_texel);
  const int volume = FinePixel((width + 7) & ~7, 0, height);  // of a direction
  const int scanline = int(gl_GlobalInvocationID.x);
  const bool is_row = step_y == 0;
  if (scanline >= (is_row ? height : width)) return;
  const int num_steps = is_row ? width : height;
  int x = is_row ? (step_x > 0 ? 0 : width - 1) : scanline;
  int y = is_row ? scanline : (step_y > 0 ? 0 : height - 1);

  uvec4 path = uvec4(0);  // L', four planes a word
  int range_before = 0;
  bool starts = true;
  for (int step = 0; step < num_steps; ++step) {
    const int pixel = FinePixel(x, y, height);
    const uvec4 cost = imageLoad(costs, pixel);
    const ivec2 range_and_jumps = ivec2(imageLoad(ranges, pixel).xy);
    const int range = range_and_jumps.x;
    const int jump = bitfieldExtract(range_and_jumps.y, jump_shift, 4);
    const int difference = abs(((range >> 16) & 0xff) - ((range_before >> 16) & 0xff));
    const uint penalty = JumpPenalty(starts ? 0 : difference);
    const int moved = (range & 0xffff) - (range_before & 0xffff) - jump;
    range_before = range;
    uint shifted[5];
    ShiftBytes(path, starts ? -1 : clamp(moved, -17, 17) - 1, shifted);
    uint below = shifted[0] & 0xffu;
    uint here = (shifted[0] >> 8) & 0xffu;
    uint least = 255u;
    uvec4 result;
    [[unroll]] for (int w = 0; w < 4; ++w) {
      uint packed = 0u;
      [[unroll]] for (int j = 0; j < 4; ++j) {
        const int next = 4 * w + j + 2;
        const uint above = (shifted[next >> 2] >> (8 * (next & 3))) & 0xffu;
        const uint best = min(min(here, penalty), min(below, above) + p1);
        const uint total = min(((cost[w] >> (8 * j)) & 0xffu) + best, 255u);
        least = min(least, total);
        packed |= total << (8 * j);
        below = here;
        here = above;
      }
      result[w] = packed;
    }
    if (kPathsBefore == 0) {
      paths[first_texel + pixel] = result;
    } else {
      PathSums sums = PathSums(uvec4(0), uvec4(0));
      AddPath(sums, result);
      [[unroll]] for (int i = 0; i < kPathsBefore; ++i) {
        const int texel = (i & 3) * volume + pixel;
        AddPath(sums, i < 4 ? imageLoad(first_paths, texel) : imageLoad(more_paths, texel));
      }
      const vec2 winner = WinnerOf(sums, cost, uint(range & 0xffff));
      inverse_depth[y * width + x] = winner.x;
      uniqueness[y * width + x] = winner.y;
    }
    path = result - uvec4(least * 0x01010101u);

    x += step_x;
    y += step_y;
    starts = !is_row && (x < 0 || x >= width);
    x = starts ? (x < 0 ? x + width : x - width) : x;
    path = starts ? uvec4(0) : path;
  }
}
