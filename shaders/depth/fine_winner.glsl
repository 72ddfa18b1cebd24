// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Of the 16 planes of a pixel that of the smallest sum over the paths, the first of equals, and
// between the planes the lowest point of the parabola through its neighbours; at an end of the
// range the plane itself. No estimate where the plane does not match, and where another one, not
// next to it, is nearly as good: the inverse depth is then negative, for the inference of surfaces,
// or 0 where no source sees the plane. The including shader declares the parameters of
// fine_winner.params.h and kSubPlane; without it the plane itself counts.

const uint kMax = 0xffffffffu;
const uint kUnseen = 255u;  // the cost of a plane that no source sees

// Sums of 16 planes, 16 bits each: planes 4 i and 4 i + 2 in even[i], the others in odd[i].
struct PathSums {
  uvec4 even, odd;
};

void AddPath(inout PathSums sums, uvec4 path) {
  sums.even += path & 0x00ff00ffu;
  sums.odd += (path >> 8) & 0x00ff00ffu;
}

// Inverse depth and uniqueness: 1 - smallest / runner-up, 0 where there is no estimate.
vec2 WinnerOf(PathSums path_sums, uvec4 costs, uint first_plane) {
  uint sums[16];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    sums[4 * i] = path_sums.even[i] & 0xffffu;
    sums[4 * i + 1] = path_sums.odd[i] & 0xffffu;
    sums[4 * i + 2] = path_sums.even[i] >> 16;
    sums[4 * i + 3] = path_sums.odd[i] >> 16;
  }
  uint best_key = kMax;  // sum and plane, ordered by sum first
  [[unroll]] for (int d = 0; d < 16; ++d) best_key = min(best_key, (sums[d] << 8) | uint(d));
  const int best = int(best_key & 0xffu);
  uint below = 0u, above = 0u, cost = 0u, second = kMax;
  [[unroll]] for (int d = 0; d < 16; ++d) {
    below = d + 1 == best ? sums[d] : below;
    above = d - 1 == best ? sums[d] : above;
    cost = d == best ? (costs[d / 4] >> (8 * (d % 4))) & 0xffu : cost;
    second = min(second, abs(d - best) > 1 ? sums[d] : kMax);
  }
  const uint here = best_key >> 8;
  const float share = second > 0u ? 1.0 - float(here) / float(second) : 0.0;
  const float curvature = float(below) - 2.0 * float(here) + float(above);
  const bool inside = kSubPlane && best > 0 && best < 15 && curvature > 0.0;
  const float offset = inside ? 0.5 * (float(below) - float(above)) / curvature : 0.0;
  const float plane = float(first_plane + uint(best)) + offset;
  const float w = params.inverse_depth + plane * params.inverse_depth_step;
  const bool valid = cost <= params.max_cost && share >= params.min_uniqueness;
  const float result = valid ? w : (cost < kUnseen ? -w : 0.0);
  return vec2(result, result > 0.0 ? share : 0.0);
}
