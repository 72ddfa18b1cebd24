// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/host/conductance_host.h"
#include "depth/host/host_kernels.h"
#include "depth/inference.params.h"
#include "depth/inference_tiles.h"
#include "depth/padded_image.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

using host::Less;
using host::LessOrEqual;
using host::Splat;

constexpr float kNoWinner = 3e38F;
constexpr int kWinnerReach = 2;  // px

// The bindings of inference.comp.
struct InferenceBindings {
  explicit InferenceBindings(const HostDispatch& dispatch)
      : depth(dispatch.BufferAs<const float>(0)),
        winners(dispatch.BufferAs<const float>(1)),
        state(dispatch.BufferAs<const float>(2)),
        image(dispatch.BufferAs<const std::uint8_t>(3)),
        cells(dispatch.BufferAs<const float>(4)),
        projections(dispatch.BufferAs<const float>(5)),
        tiles(dispatch.BufferAs<const std::uint32_t>(6)),
        inverse_depth(dispatch.BufferAs<float>(7)),
        confidence(dispatch.BufferAs<float>(8)),
        num_sources(2 * (dispatch.constants.empty() ? 2 : dispatch.constants[0])) {}

  const float* depth;
  const float* winners;
  const float* state;
  const std::uint8_t* image;
  const float* cells;
  const float* projections;
  const std::uint32_t* tiles;
  float* inverse_depth;
  float* confidence;
  std::uint32_t num_sources;
};

// Eight pixels of a row; beyond the image its last column stands for them.
struct PixelsOfRow {
  std::array<std::int32_t, host::kLanes> columns;
  int y;
};

struct InferredSurface {
  __m256 inverse_depth, confidence;
};

// The mean of the four pixels of half the resolution around, by distance and likeness.
MONO3D_AVX2 inline InferredSurface SurfaceAt(const InferenceParams& push,
                                             const InferenceBindings& bindings,
                                             const PixelsOfRow& pixels) {
  const LevelSize size{push.width_px, push.height_px};
  const int half_width = static_cast<int>(size.Halved().width_px);
  const int half_height = static_cast<int>(size.Halved().height_px);
  const std::uint8_t* const row =
      bindings.image +
      (static_cast<std::size_t>(pixels.y) + kImagePadding) * 4 * PaddedWordsPerRow(size) +
      kImagePadding;
  alignas(32) std::array<float, host::kLanes> greys;
  for (std::size_t i = 0; i < host::kLanes; ++i) greys[i] = row[pixels.columns[i]];
  const __m256 grey = _mm256_load_ps(greys.data());
  __m256 depths = _mm256_setzero_ps();
  __m256 confidences = _mm256_setzero_ps();
  __m256 weights = _mm256_setzero_ps();
  for (int k = 0; k < 4; ++k) {
    const int side_y = (pixels.y & 1) != 0 ? 1 : -1;
    const int state_row = std::clamp((pixels.y >> 1) + (k >> 1) * side_y, 0, half_height - 1);
    std::array<std::int32_t, host::kLanes> at;
    for (std::size_t i = 0; i < host::kLanes; ++i) {
      const int side_x = (pixels.columns[i] & 1) != 0 ? 1 : -1;
      const int column = std::clamp((pixels.columns[i] >> 1) + (k & 1) * side_x, 0, half_width - 1);
      at[i] = state_row * half_width + column;
    }
    const host::Vec4 one = host::GatherVec4(bindings.state, at.data());
    const float by_distance = ((k & 1) != 0 ? 0.25F : 0.75F) * ((k >> 1) != 0 ? 0.25F : 0.75F);
    const __m256 weight = Splat(by_distance) * host::Conductance(grey, one.z);
    depths = depths + weight * one.x;
    confidences = confidences + weight * one.y;
    weights = weights + weight;
  }
  return {depths / weights, confidences / weights};
}

// From the second nearest of the winners around.
MONO3D_AVX2 inline __m256 DifferenceFromWinners(const InferenceParams& push,
                                                const InferenceBindings& bindings,
                                                const PixelsOfRow& pixels, __m256 w) {
  const auto level = static_cast<int>(push.winner_level);
  __m256 least = Splat(kNoWinner);
  __m256 second = Splat(kNoWinner);
  for (int k = 0; k < 5; ++k) {
    const int row = pixels.y + (k == 3 ? -kWinnerReach : (k == 4 ? kWinnerReach : 0));
    if (row < 0 || row >= static_cast<int>(push.height_px)) continue;
    const int step = k == 1 ? -kWinnerReach : (k == 2 ? kWinnerReach : 0);
    alignas(32) std::array<float, host::kLanes> winners;
    for (std::size_t i = 0; i < host::kLanes; ++i) {
      const int column = pixels.columns[i] + step;
      const bool inside = column >= 0 && column < static_cast<int>(push.width_px);
      winners[i] =
          inside ? bindings.winners[static_cast<std::size_t>(row >> level) * push.winner_width_px +
                                    static_cast<std::size_t>(column >> level)]
                 : 0.0F;
    }
    const __m256 winner = host::Abs(_mm256_load_ps(winners.data()));
    const __m256 difference =
        host::Select(Less(_mm256_setzero_ps(), winner), host::Abs(w - winner), Splat(kNoWinner));
    second = _mm256_min_ps(second, _mm256_max_ps(least, difference));
    least = _mm256_min_ps(least, difference);
  }
  return second;
}

MONO3D_AVX2 inline __m256 NumViews(const InferenceBindings& bindings, __m256 x, __m256 y,
                                   __m256 w) {
  __m256 num_views = _mm256_setzero_ps();
  for (std::uint32_t s = 0; s < bindings.num_sources; ++s) {
    const float* const a = bindings.projections + 16 * std::size_t{s} + 4;
    const float* const b = a + 9;
    const float* const bounds = a + 12;
    __m256 at[3];
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = Splat(a[3 * i]) * x + Splat(a[3 * i + 1]) * y + Splat(a[3 * i + 2]) + w * Splat(b[i]);
    }
    const __m256 from = _mm256_and_ps(LessOrEqual(at[2] * Splat(bounds[0]), at[0]),
                                      LessOrEqual(at[2] * Splat(bounds[1]), at[1]));
    const __m256 to =
        _mm256_and_ps(Less(at[0], at[2] * Splat(bounds[2])), Less(at[1], at[2] * Splat(bounds[3])));
    const __m256 is_visible =
        _mm256_and_ps(Less(_mm256_setzero_ps(), at[2]), _mm256_and_ps(from, to));
    num_views = num_views + _mm256_and_ps(is_visible, Splat(1.0F));
  }
  return num_views;
}

MONO3D_AVX2 void InferEight(const InferenceParams& push, const InferenceBindings& bindings,
                            const PixelsOfRow& pixels, unsigned lanes) {
  const InferredSurface surface = SurfaceAt(push, bindings, pixels);
  const __m256 w = surface.inverse_depth;
  const std::size_t first_cell =
      static_cast<std::size_t>(pixels.y >> 2) * ((push.width_px + 3) / 4);
  alignas(32) std::array<float, host::kLanes> cells;
  alignas(32) std::array<float, host::kLanes> coarse_depths;
  alignas(32) std::array<float, host::kLanes> coarse_steps;
  alignas(32) std::array<float, host::kLanes> coarse_confidences;
  alignas(32) std::array<float, host::kLanes> columns;
  for (std::size_t i = 0; i < host::kLanes; ++i) {
    const float* const cell =
        bindings.cells + 4 * (first_cell + static_cast<std::size_t>(pixels.columns[i] >> 2));
    coarse_depths[i] = cell[0];
    coarse_steps[i] = cell[1];
    coarse_confidences[i] = cell[2];
    cells[i] = cell[3];
    columns[i] = static_cast<float>(pixels.columns[i]);
  }
  const __m256 cell = _mm256_load_ps(cells.data());
  const __m256 coarse_step = _mm256_load_ps(coarse_steps.data());
  const __m256 x = _mm256_load_ps(columns.data());
  const __m256 y = Splat(static_cast<float>(pixels.y));
  const __m256 one = Splat(1.0F);
  const __m256 from_winners =
      DifferenceFromWinners(push, bindings, pixels, w) / Splat(push.inverse_depth_step);
  const __m256 is_no_plane = _mm256_cmp_ps(cell, _mm256_setzero_ps(), _CMP_EQ_OQ);
  const __m256 is_matched_coarsely =
      _mm256_and_ps(is_no_plane, Less(_mm256_setzero_ps(), coarse_step));
  const __m256 from_coarse = host::Select(
      is_matched_coarsely, host::Abs(w - _mm256_load_ps(coarse_depths.data())) / coarse_step,
      Splat(kNoWinner));
  const __m256 difference =
      host::Select(Less(one, cell), _mm256_min_ps(from_winners, one), from_winners);
  const __m256 most = Splat(push.max_difference);
  const __m256 is_near =
      _mm256_or_ps(LessOrEqual(difference, most), LessOrEqual(from_coarse, most));
  const float* const shown = bindings.projections;  // bounds of the reference
  const __m256 is_shown = _mm256_and_ps(
      _mm256_and_ps(LessOrEqual(Splat(shown[0]), x), LessOrEqual(Splat(shown[1]), y)),
      _mm256_and_ps(LessOrEqual(x, Splat(shown[2])), LessOrEqual(y, Splat(shown[3]))));
  const __m256 is_no_sky = LessOrEqual(_mm256_setzero_ps(), cell);
  const __m256 is_above_zero = Less(_mm256_setzero_ps(), w);
  lanes &= host::BitsOf(
      _mm256_and_ps(_mm256_and_ps(is_shown, is_near), _mm256_and_ps(is_no_sky, is_above_zero)));
  if (lanes == 0) return;
  const __m256 num_views = NumViews(bindings, x, y, w);
  const __m256 is_guess =
      _mm256_and_ps(LessOrEqual(difference, most), LessOrEqual(Splat(push.min_views), num_views));
  const __m256 is_coarse = _mm256_and_ps(LessOrEqual(from_coarse, most),
                                         LessOrEqual(Splat(push.min_coarse_views), num_views));
  lanes &= host::BitsOf(_mm256_or_ps(is_guess, is_coarse));
  if (lanes == 0) return;

  const __m256 guessed =
      _mm256_and_ps(is_guess, surface.confidence / (one + difference * difference));
  const __m256 coarsely = _mm256_and_ps(
      is_coarse, _mm256_load_ps(coarse_confidences.data()) / (one + from_coarse * from_coarse));
  // Of inference.comp: kLeastConfidence and kMostConfidence.
  const __m256 confidence =
      _mm256_min_ps(_mm256_max_ps(_mm256_max_ps(guessed, coarsely), Splat(0.004F)), Splat(0.125F));
  alignas(32) std::array<float, host::kLanes> depths;
  alignas(32) std::array<float, host::kLanes> confidences;
  _mm256_store_ps(depths.data(), w);
  _mm256_store_ps(confidences.data(), confidence);
  const unsigned coarse_lanes = host::BitsOf(is_coarse);
  const std::size_t first = static_cast<std::size_t>(pixels.y) * push.width_px;
  for (std::size_t i = 0; i < host::kLanes; ++i) {
    if ((lanes >> i & 1U) == 0) continue;
    const std::size_t pixel = first + static_cast<std::size_t>(pixels.columns[i]);
    bindings.inverse_depth[pixel] = depths[i];
    bindings.confidence[pixel] = (coarse_lanes >> i & 1U) != 0 ? -confidences[i] : confidences[i];
  }
}

void InferRow(const InferenceParams& push, const InferenceBindings& bindings, int first, int end,
              int y) {
  const float* const depth = bindings.depth + static_cast<std::size_t>(y) * push.width_px;
  constexpr int kLanes = host::kLanes;
  for (int x = first; x < end; x += kLanes) {
    PixelsOfRow pixels{{}, y};
    unsigned lanes = 0;  // that were not matched
    for (int i = 0; i < kLanes; ++i) {
      const int column = std::min(x + i, static_cast<int>(push.width_px) - 1);
      pixels.columns[static_cast<std::size_t>(i)] = column;
      if (x + i < end && depth[column] <= 0) lanes |= 1U << i;
    }
    if (lanes != 0) InferEight(push, bindings, pixels, lanes);
  }
}

void RunInference(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<InferenceParams>();
  const InferenceBindings bindings(dispatch);
  const cv::Size size(static_cast<int>(push.width_px), static_cast<int>(push.height_px));
  // The dispatch has a workgroup for each pair of rows of a tile.
  const HostShare tiles =
      ShareOf(dispatch.num_workgroups / (kInferenceTileHeight / 2), 1, part, num_parts);
  for (std::uint32_t i = tiles.first; i < tiles.end; ++i) {
    const cv::Rect pixels = PixelsOfTile(bindings.tiles[i], size);  // none at the end of the list
    for (int y = pixels.y; y < pixels.br().y; ++y) {
      InferRow(push, bindings, pixels.x, pixels.br().x, y);
    }
  }
}

}  // namespace

const HostKernel kInferenceOnHost = RunInference;
#else
const HostKernel kInferenceOnHost = nullptr;
#endif

}  // namespace mono3d
