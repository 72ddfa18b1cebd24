// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/host/conductance_host.h"
#include "depth/host/host_kernels.h"
#include "depth/inference_relax.params.h"
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
using host::Splat;
using host::Vec4;

// Sums of inverse depths, confidences and weights.
struct RelaxSums {
  __m256 depth, confidence, weight;
};

MONO3D_AVX2 inline void AddNeighbour(__m256 grey, const Vec4& other, __m256 is_inside,
                                     RelaxSums& sums) {
  const __m256 weight = _mm256_and_ps(is_inside, host::Conductance(grey, other.z));
  sums.depth = sums.depth + weight * other.x;
  sums.confidence = sums.confidence + weight * other.y;
  sums.weight = sums.weight + weight;
}

MONO3D_AVX2 void RelaxRow(const HostDispatch& dispatch, const InferenceRelaxParams& push,
                          std::size_t y) {
  const std::size_t width = push.width_px;
  const auto* const data = dispatch.BufferAs<const float>(0);
  const auto* const before = dispatch.BufferAs<const float>(1);
  auto* const after = dispatch.BufferAs<float>(2);
  const __m256 all = _mm256_castsi256_ps(Splat(-1));
  const __m256 none = _mm256_setzero_ps();
  for (std::size_t x = 0; x < width; x += host::kLanes) {
    const std::size_t num = std::min<std::size_t>(host::kLanes, width - x);
    const std::size_t pixel = y * width + x;
    // Of lanes beyond the image the last pixel; of neighbours outside the pixel itself.
    alignas(32) std::array<std::int32_t, host::kLanes> here, left, right, above, below;
    alignas(32) std::array<float, host::kLanes> has_left, has_right;
    for (std::size_t i = 0; i < host::kLanes; ++i) {
      const std::size_t column = x + std::min(i, num - 1);
      const auto at = static_cast<std::int32_t>(y * width + column);
      const auto row = static_cast<std::int32_t>(width);
      here[i] = at;
      left[i] = column > 0 ? at - 1 : at;
      right[i] = column + 1 < width ? at + 1 : at;
      above[i] = y > 0 ? at - row : at;
      below[i] = y + 1 < push.height_px ? at + row : at;
      has_left[i] = column > 0 ? 1.0F : 0.0F;
      has_right[i] = column + 1 < width ? 1.0F : 0.0F;
    }
    const Vec4 own = host::GatherVec4(data, here.data());
    RelaxSums sums = {own.y * own.x, own.y * own.z, own.y};
    AddNeighbour(own.w, host::GatherVec4(before, left.data()),
                 Less(none, _mm256_load_ps(has_left.data())), sums);
    AddNeighbour(own.w, host::GatherVec4(before, right.data()),
                 Less(none, _mm256_load_ps(has_right.data())), sums);
    AddNeighbour(own.w, host::GatherVec4(before, above.data()), y > 0 ? all : none, sums);
    AddNeighbour(own.w, host::GatherVec4(before, below.data()), y + 1 < push.height_px ? all : none,
                 sums);
    const __m256 depth = _mm256_and_ps(Less(none, sums.weight), sums.depth / sums.weight);
    host::StoreVec4(after + 4 * pixel,
                    {depth, sums.confidence / (sums.weight + Splat(push.leak)), own.w, none},
                    (1U << num) - 1);
  }
}

void RunInferenceRelax(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<InferenceRelaxParams>();
  const HostShare rows = ShareOf(push.height_px, 1, part, num_parts);
  for (std::uint32_t y = rows.first; y < rows.end; ++y) RelaxRow(dispatch, push, y);
}

}  // namespace

const HostKernel kInferenceRelaxOnHost = RunInferenceRelax;
#else
const HostKernel kInferenceRelaxOnHost = nullptr;
#endif

}  // namespace mono3d
