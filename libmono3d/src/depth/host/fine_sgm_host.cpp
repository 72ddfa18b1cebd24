// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_sgm.params.h"
#include "depth/fine_volume.h"
#include "depth/host/host_kernels.h"

#if MONO3D_HAS_AVX2
#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

constexpr int kScanlines = 8;  // worked on together, in pairs: one hides what another waits for
constexpr int kPairs = kScanlines / 2;

// Bytes that pick byte `first` + i of a path, or nothing where there is none; first is -18 .. 18.
struct ShiftTable {
  alignas(64) std::array<std::uint8_t, 56> bytes{};

  constexpr ShiftTable() {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::uint8_t>(i < 20 || i >= 36 ? 0x80 : i - 20);
    }
  }
  const std::uint8_t* From(int first) const { return bytes.data() + 20 + first; }
};
constexpr ShiftTable kShifts;

struct PathParams {
  explicit PathParams(const HostDispatch& dispatch)
      : push(dispatch.PushAs<FineSgmParams>()),
        num_paths_before(dispatch.constants.empty() ? 0 : static_cast<int>(dispatch.constants[0])),
        sub_plane(dispatch.constants.size() < 2 || dispatch.constants[1] != 0),
        costs(dispatch.BufferAs<const std::uint8_t>(0)),
        ranges(dispatch.BufferAs<const std::uint32_t>(1)),
        first_paths(dispatch.BufferAs<const std::uint8_t>(2)),
        more_paths(dispatch.BufferAs<const std::uint8_t>(3)),
        paths(dispatch.BufferAs<std::uint8_t>(4) + kFinePlanes * std::size_t{push.first_texel}),
        inverse_depth(dispatch.BufferAs<float>(5)),
        uniqueness(dispatch.BufferAs<float>(6)),
        width(static_cast<int>(push.width_px)),
        height(static_cast<int>(push.height_px)),
        volume_bytes(kFinePlanes * NumFinePixels({push.width_px, push.height_px})) {}

  FineSgmParams push;
  int num_paths_before;  // 0: not the last direction
  bool sub_plane;
  const std::uint8_t* costs;
  const std::uint32_t* ranges;
  const std::uint8_t* first_paths;
  const std::uint8_t* more_paths;
  std::uint8_t* paths;
  float* inverse_depth;
  float* uniqueness;
  int width, height;
  std::size_t volume_bytes;  // of a direction
};

MONO3D_AVX2 inline __m256i LoadPair(const std::uint8_t* low, const std::uint8_t* high) {
  const __m128i first = _mm_loadu_si128(reinterpret_cast<const __m128i*>(low));
  const __m128i second = _mm_loadu_si128(reinterpret_cast<const __m128i*>(high));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(first), second, 1);
}

MONO3D_AVX2 inline __m256i LoadEight(const std::array<std::int32_t, kScanlines>& values) {
  return _mm256_load_si256(reinterpret_cast<const __m256i*>(values.data()));
}

// The largest byte of each half, in all of its bytes.
MONO3D_AVX2 inline __m256i LargestOfHalves(__m256i bytes) {
  bytes = _mm256_max_epu8(bytes, _mm256_alignr_epi8(bytes, bytes, 8));
  bytes = _mm256_max_epu8(bytes, _mm256_alignr_epi8(bytes, bytes, 4));
  bytes = _mm256_max_epu8(bytes, _mm256_alignr_epi8(bytes, bytes, 2));
  return _mm256_max_epu8(bytes, _mm256_alignr_epi8(bytes, bytes, 1));
}

// Lanes of 16 bits that are set for a plane and its neighbours: they have no say in who is second.
struct NeighbourMasks {
  alignas(32) std::array<std::array<std::uint16_t, kFinePlanes>, kFinePlanes> masks{};

  constexpr NeighbourMasks() {
    for (std::size_t best = 0; best < kFinePlanes; ++best) {
      for (std::size_t plane = 0; plane < kFinePlanes; ++plane) {
        masks[best][plane] = plane + 1 >= best && plane <= best + 1 ? 0xffff : 0;
      }
    }
  }
};
constexpr NeighbourMasks kNeighbours;

// What one step of eight scanlines needs besides costs.
struct Step {
  std::array<std::size_t, kScanlines> pixels;
  alignas(32) std::array<std::int32_t, kScanlines> ranges;  // first words
  alignas(32) std::array<std::int32_t, kScanlines> jumps;   // second words
  alignas(32) std::array<std::int32_t, kScanlines> shifts;
  alignas(32) std::array<std::int32_t, kScanlines> penalties;  // 255 - P2
};

// Of eight pixels, what fine_winner.glsl looks for among the sums of 16 planes.
struct Winners {
  alignas(32) std::array<std::int32_t, kScanlines> best;  // plane of the least sum, 0 to 15
  alignas(32) std::array<std::int32_t, kScanlines> here;  // its sum
  alignas(32) std::array<std::int32_t, kScanlines> second;
  alignas(32) std::array<std::int32_t, kScanlines> below;  // sums next to it, where there are any
  alignas(32) std::array<std::int32_t, kScanlines> above;
  alignas(32) std::array<std::int32_t, kScanlines> cost;
};

// From the ranges here and those before, which it replaces by those here. Where a path `starts`
// anew there is no shift, and its penalty does not count.
MONO3D_AVX2 inline void FindShifts(const FineSgmParams& push, __m256i starts, __m256i& before,
                                   Step& step) {
  const __m256i ranges = LoadEight(step.ranges);
  const __m256i jumps = LoadEight(step.jumps);
  const __m256i low16 = _mm256_set1_epi32(0xffff);
  const __m256i to_top = _mm256_set1_epi32(28 - 4 * static_cast<int>(push.direction));
  const __m256i jump = _mm256_srai_epi32(_mm256_sllv_epi32(jumps, to_top), 28);
  const __m256i moved = _mm256_sub_epi32(
      _mm256_sub_epi32(_mm256_and_si256(ranges, low16), _mm256_and_si256(before, low16)), jump);
  const __m256i in_table =
      _mm256_max_epi32(_mm256_min_epi32(moved, _mm256_set1_epi32(17)), _mm256_set1_epi32(-17));
  _mm256_store_si256(reinterpret_cast<__m256i*>(step.shifts.data()),
                     _mm256_andnot_si256(starts, in_table));
  const __m256i low8 = _mm256_set1_epi32(0xff);
  const __m256i difference =
      _mm256_abs_epi32(_mm256_sub_epi32(_mm256_and_si256(_mm256_srli_epi32(ranges, 16), low8),
                                        _mm256_and_si256(_mm256_srli_epi32(before, 16), low8)));
  const __m256 falling = _mm256_add_ps(
      _mm256_div_ps(_mm256_set1_ps(push.p2_times_gradient),
                    _mm256_add_ps(_mm256_set1_ps(push.gradient), _mm256_cvtepi32_ps(difference))),
      _mm256_set1_ps(5e-4F));
  const __m256i penalty =
      _mm256_min_epi32(_mm256_max_epi32(_mm256_cvttps_epi32(falling),
                                        _mm256_set1_epi32(static_cast<int>(push.min_p2))),
                       low8);
  _mm256_store_si256(reinterpret_cast<__m256i*>(step.penalties.data()),
                     _mm256_sub_epi32(low8, penalty));
  before = ranges;
}

// One pixel of two scanlines. All bytes are complements, 255 - value: what a shift does not find is
// then 0, as the instruction has it. `path`: 255 - L'; `costs`: as they are; returns 255 - L.
MONO3D_AVX2 inline __m256i StepOfPair(__m256i& path, __m256i costs, __m256i p1, const Step& step,
                                      std::size_t pair) {
  const std::uint8_t* const first = kShifts.From(step.shifts[2 * pair]);
  const std::uint8_t* const second = kShifts.From(step.shifts[2 * pair + 1]);
  const __m256i below = _mm256_shuffle_epi8(path, LoadPair(first - 1, second - 1));
  const __m256i here = _mm256_shuffle_epi8(path, LoadPair(first, second));
  const __m256i above = _mm256_shuffle_epi8(path, LoadPair(first + 1, second + 1));
  const __m256i penalty = _mm256_inserti128_si256(
      _mm256_castsi128_si256(_mm_set1_epi8(static_cast<char>(step.penalties[2 * pair]))),
      _mm_set1_epi8(static_cast<char>(step.penalties[2 * pair + 1])), 1);
  const __m256i best = _mm256_max_epu8(_mm256_max_epu8(here, penalty),
                                       _mm256_subs_epu8(_mm256_max_epu8(below, above), p1));
  const __m256i result = _mm256_subs_epu8(best, costs);
  // 255 - (L - least L), the largest of the complements being 255 - least L.
  path = _mm256_sub_epi8(result, _mm256_add_epi8(LargestOfHalves(result), _mm256_set1_epi8(1)));
  return result;
}

MONO3D_AVX2 inline void StorePaths(const PathParams& params, __m256i paths, const Step& step,
                                   std::size_t pair) {
  std::uint8_t* const low = params.paths + kFinePlanes * step.pixels[2 * pair];
  std::uint8_t* const high = params.paths + kFinePlanes * step.pixels[2 * pair + 1];
  _mm_store_si128(reinterpret_cast<__m128i*>(low), _mm256_castsi256_si128(paths));
  _mm_store_si128(reinterpret_cast<__m128i*>(high), _mm256_extracti128_si256(paths, 1));
}

// Sums of 16 bits, of planes 0 to 7 and 8 to 15.
MONO3D_AVX2 inline void FindWinner(__m128i low, __m128i high, const std::uint8_t* costs,
                                   Winners& winners, std::size_t i) {
  const __m128i least_low = _mm_minpos_epu16(low);
  const __m128i least_high = _mm_minpos_epu16(high);
  // The sum and behind it the plane, so that the first of equals is the least.
  const auto key_of = [](std::uint32_t sum_and_lane) {
    return sum_and_lane << 16 | sum_and_lane >> 16;
  };
  const std::uint32_t key =
      std::min(key_of(static_cast<std::uint32_t>(_mm_cvtsi128_si32(least_low))),
               key_of(static_cast<std::uint32_t>(_mm_cvtsi128_si32(least_high))) + 8);
  const std::size_t best = key & 0xffffU;
  const auto* const near = reinterpret_cast<const __m128i*>(kNeighbours.masks[best].data());
  const __m128i others = _mm_min_epu16(_mm_or_si128(low, _mm_load_si128(near)),
                                       _mm_or_si128(high, _mm_load_si128(near + 1)));
  alignas(16) std::array<std::uint16_t, 1 + 7 + kFinePlanes + 8> sums;
  _mm_store_si128(reinterpret_cast<__m128i*>(sums.data() + 8), low);
  _mm_store_si128(reinterpret_cast<__m128i*>(sums.data() + 16), high);
  sums[7] = sums[24] = 0;
  winners.best[i] = static_cast<std::int32_t>(best);
  winners.here[i] = static_cast<std::int32_t>(key >> 16);
  winners.second[i] = _mm_extract_epi16(_mm_minpos_epu16(others), 0);
  winners.below[i] = sums[8 + best - 1];
  winners.above[i] = sums[8 + best + 1];
  winners.cost[i] = costs[best];
}

// Of the pixels of two scanlines: `paths` and those of the directions before, added up.
MONO3D_AVX2 inline void FindWinners(const PathParams& params, __m256i paths, const Step& step,
                                    std::size_t pair, Winners& winners) {
  const std::size_t low_bytes = kFinePlanes * step.pixels[2 * pair];
  const std::size_t high_bytes = kFinePlanes * step.pixels[2 * pair + 1];
  const __m256i zero = _mm256_setzero_si256();
  __m256i low = _mm256_unpacklo_epi8(paths, zero);
  __m256i high = _mm256_unpackhi_epi8(paths, zero);
  for (int before = 0; before < params.num_paths_before; ++before) {
    const std::uint8_t* const volume = (before < 4 ? params.first_paths : params.more_paths) +
                                       static_cast<std::size_t>(before & 3) * params.volume_bytes;
    const __m256i other = LoadPair(volume + low_bytes, volume + high_bytes);
    low = _mm256_add_epi16(low, _mm256_unpacklo_epi8(other, zero));
    high = _mm256_add_epi16(high, _mm256_unpackhi_epi8(other, zero));
  }
  FindWinner(_mm256_castsi256_si128(low), _mm256_castsi256_si128(high), params.costs + low_bytes,
             winners, 2 * pair);
  FindWinner(_mm256_extracti128_si256(low, 1), _mm256_extracti128_si256(high, 1),
             params.costs + high_bytes, winners, 2 * pair + 1);
}

// Depth and uniqueness of eight pixels, as WinnerOf of fine_winner.glsl, to the pixels `to`.
MONO3D_AVX2 inline void StoreWinners(const PathParams& params, const Winners& winners,
                                     const Step& step,
                                     const std::array<std::size_t, kScanlines>& to) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 one = _mm256_set1_ps(1.0F);
  const __m256i best = LoadEight(winners.best);
  const __m256 here = _mm256_cvtepi32_ps(LoadEight(winners.here));
  const __m256 second = _mm256_cvtepi32_ps(LoadEight(winners.second));
  const __m256 below = _mm256_cvtepi32_ps(LoadEight(winners.below));
  const __m256 above = _mm256_cvtepi32_ps(LoadEight(winners.above));
  const __m256 share = _mm256_and_ps(_mm256_sub_ps(one, _mm256_div_ps(here, second)),
                                     _mm256_cmp_ps(second, zero, _CMP_GT_OQ));
  const __m256 curvature =
      _mm256_add_ps(_mm256_sub_ps(below, _mm256_mul_ps(_mm256_set1_ps(2.0F), here)), above);
  const __m256i in_range = _mm256_and_si256(_mm256_cmpgt_epi32(best, _mm256_setzero_si256()),
                                            _mm256_cmpgt_epi32(_mm256_set1_epi32(15), best));
  const __m256 inside = _mm256_and_ps(_mm256_cmp_ps(curvature, zero, _CMP_GT_OQ),
                                      _mm256_castsi256_ps(_mm256_and_si256(
                                          in_range, _mm256_set1_epi32(params.sub_plane ? -1 : 0))));
  const __m256 between =
      _mm256_div_ps(_mm256_mul_ps(_mm256_set1_ps(0.5F), _mm256_sub_ps(below, above)), curvature);
  const __m256i first_plane = _mm256_and_si256(LoadEight(step.ranges), _mm256_set1_epi32(0xffff));
  const __m256 plane = _mm256_add_ps(_mm256_cvtepi32_ps(_mm256_add_epi32(first_plane, best)),
                                     _mm256_and_ps(between, inside));
  const __m256 w =
      _mm256_add_ps(_mm256_set1_ps(params.push.inverse_depth),
                    _mm256_mul_ps(plane, _mm256_set1_ps(params.push.inverse_depth_step)));
  const __m256i cost = LoadEight(winners.cost);
  const __m256 matches = _mm256_castsi256_ps(_mm256_cmpgt_epi32(
      _mm256_set1_epi32(static_cast<int>(std::min(params.push.max_cost, 255U)) + 1), cost));
  const __m256 valid = _mm256_and_ps(
      matches, _mm256_cmp_ps(share, _mm256_set1_ps(params.push.min_uniqueness), _CMP_GE_OQ));
  const __m256 seen = _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(255), cost));
  const __m256 not_valid = _mm256_and_ps(_mm256_xor_ps(w, _mm256_set1_ps(-0.0F)), seen);
  const __m256 result = _mm256_blendv_ps(not_valid, w, valid);
  alignas(32) std::array<float, kScanlines> results;
  alignas(32) std::array<float, kScanlines> shares;
  _mm256_store_ps(results.data(), result);
  _mm256_store_ps(shares.data(), _mm256_and_ps(share, _mm256_cmp_ps(result, zero, _CMP_GT_OQ)));
  for (std::size_t i = 0; i < kScanlines; ++i) {
    params.inverse_depth[to[i]] = results[i];
    params.uniqueness[to[i]] = shares[i];
  }
}

// Eight scanlines that lie side by side. `num_scanlines` of them exist; the others repeat the last.
template <bool kIsLast>
MONO3D_AVX2 void RunScanlines(const PathParams& params, int first_scanline, int num_scanlines) {
  const FineSgmParams& push = params.push;
  const bool is_row = push.step_y == 0;
  const int num_steps = is_row ? params.width : params.height;
  const __m256i p1 = _mm256_set1_epi8(static_cast<char>(std::min(push.p1, 255U)));
  const __m256i fresh = _mm256_set1_epi8(-1);  // L' = 0
  __m256i paths[kPairs] = {fresh, fresh, fresh, fresh};
  __m256i before = _mm256_setzero_si256();
  alignas(32) std::array<std::int32_t, kScanlines> starts;
  starts.fill(-1);
  std::array<int, kScanlines> x, y;
  for (std::size_t i = 0; i < kScanlines; ++i) {
    const int scanline = first_scanline + std::min(static_cast<int>(i), num_scanlines - 1);
    x[i] = is_row ? (push.step_x > 0 ? 0 : params.width - 1) : scanline;
    y[i] = is_row ? scanline : (push.step_y > 0 ? 0 : params.height - 1);
  }
  Step step;
  Winners winners;
  std::array<std::size_t, kScanlines> to;
  for (int done = 0; done < num_steps; ++done) {
    for (std::size_t i = 0; i < kScanlines; ++i) {
      step.pixels[i] = FinePixelAt(static_cast<std::size_t>(x[i]), static_cast<std::size_t>(y[i]),
                                   push.height_px);
      step.ranges[i] = static_cast<std::int32_t>(params.ranges[2 * step.pixels[i]]);
      step.jumps[i] = static_cast<std::int32_t>(params.ranges[2 * step.pixels[i] + 1]);
    }
    FindShifts(push, LoadEight(starts), before, step);
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      const __m256i costs = LoadPair(params.costs + kFinePlanes * step.pixels[2 * pair],
                                     params.costs + kFinePlanes * step.pixels[2 * pair + 1]);
      const __m256i complements = StepOfPair(paths[pair], costs, p1, step, pair);
      const __m256i result = _mm256_xor_si256(complements, _mm256_set1_epi8(-1));
      if constexpr (kIsLast) {
        FindWinners(params, result, step, pair, winners);
      } else {
        StorePaths(params, result, step, pair);
      }
    }
    if constexpr (kIsLast) {
      for (std::size_t i = 0; i < kScanlines; ++i) {
        to[i] = static_cast<std::size_t>(y[i]) * push.width_px + static_cast<std::size_t>(x[i]);
      }
      StoreWinners(params, winners, step, to);
    }
    for (std::size_t i = 0; i < kScanlines; ++i) {
      x[i] += push.step_x;
      y[i] += push.step_y;
      starts[i] = 0;
      if (is_row || (x[i] >= 0 && x[i] < params.width)) continue;
      // A diagonal scanline wraps around.
      x[i] += x[i] < 0 ? params.width : -params.width;
      starts[i] = -1;
      const __m256i halves = _mm256_set_epi64x(-(i & 1), -(i & 1), (i & 1) - 1, (i & 1) - 1);
      paths[i / 2] = _mm256_or_si256(paths[i / 2], halves);
    }
  }
}

void RunFineSgm(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const PathParams params(dispatch);
  const bool is_row = params.push.step_y == 0;
  const HostShare share =
      ShareOf(is_row ? params.push.height_px : params.push.width_px, kScanlines, part, num_parts);
  for (std::uint32_t first = share.first; first < share.end; first += kScanlines) {
    const auto num = static_cast<int>(std::min<std::uint32_t>(kScanlines, share.end - first));
    if (params.num_paths_before > 0) {
      RunScanlines<true>(params, static_cast<int>(first), num);
    } else {
      RunScanlines<false>(params, static_cast<int>(first), num);
    }
  }
}

}  // namespace

const HostKernel kFineSgmOnHost = RunFineSgm;
#else
const HostKernel kFineSgmOnHost = nullptr;
#endif

}  // namespace mono3d
