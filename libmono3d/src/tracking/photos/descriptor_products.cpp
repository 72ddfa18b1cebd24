// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/descriptor_products.h"

#include <algorithm>
#include <array>
// On x86-64 the loops below are compiled twice: for every processor, and for those with AVX2, which
// need 2/3 of the time.
#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define MONO3D_WITH_AVX2 1
#define MONO3D_INLINE [[gnu::always_inline]] inline
#else
#define MONO3D_WITH_AVX2 0
#define MONO3D_INLINE inline
#endif

namespace mono3d::tracking {
namespace {

constexpr std::size_t kRowsAtOnce = 4;
constexpr std::size_t kLanes = 16;  // features of b that are looked at together

// Products of four descriptors, one after the other in memory, with each of `b`.
MONO3D_INLINE void MultiplyFour(const std::int16_t* four, const std::int16_t* b, std::size_t num_b,
                                std::size_t stride, std::int32_t* products) {
  for (std::size_t k = 0; k < num_b; ++k) {
    const std::int16_t* other = b + k * kSiftSize;
    std::int32_t sum0 = 0;
    std::int32_t sum1 = 0;
    std::int32_t sum2 = 0;
    std::int32_t sum3 = 0;
    for (int d = 0; d < kSiftSize; ++d) {
      const std::int32_t value = other[d];
      sum0 += four[d] * value;
      sum1 += four[kSiftSize + d] * value;
      sum2 += four[2 * kSiftSize + d] * value;
      sum3 += four[3 * kSiftSize + d] * value;
    }
    products[k] = sum0;
    products[stride + k] = sum1;
    products[2 * stride + k] = sum2;
    products[3 * stride + k] = sum3;
  }
}

// As MostSimilar::Take of each of b's features, and of `feature_a` the other way round. Without
// branches, so that many are taken at once; `stride` is a multiple of kLanes.
MONO3D_INLINE void TakeRow(const std::int32_t* products, std::size_t stride, std::size_t feature_a,
                           MostSimilar* of_a, MostSimilar* of_b) {
  std::int32_t* const best_b = of_b->best.data();
  std::int32_t* const second_b = of_b->second.data();
  std::int32_t* const index_b = of_b->index.data();
  const auto index_a = static_cast<std::int32_t>(feature_a);
  std::array<std::int32_t, kLanes> best;
  std::array<std::int32_t, kLanes> second;
  std::array<std::int32_t, kLanes> index;
  best.fill(-1);
  second.fill(-1);
  index.fill(-1);
  for (std::size_t first = 0; first < stride; first += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = first + lane;
      const std::int32_t product = products[k];
      second_b[k] = std::max(second_b[k], std::min(best_b[k], product));
      index_b[k] = product > best_b[k] ? index_a : index_b[k];
      best_b[k] = std::max(best_b[k], product);
      second[lane] = std::max(second[lane], std::min(best[lane], product));
      index[lane] = product > best[lane] ? static_cast<std::int32_t>(k) : index[lane];
      best[lane] = std::max(best[lane], product);
    }
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    of_a->Take(feature_a, best[lane], index[lane]);
    of_a->Take(feature_a, second[lane], index[lane]);
  }
}

MONO3D_INLINE void FindAll(const DescriptorMatrix& a, std::size_t num_a, const DescriptorMatrix& b,
                           std::size_t num_b, std::size_t stride,
                           std::vector<std::int32_t>* products, SimilarFeatures* found) {
  for (std::size_t first = 0; first < num_a; first += kRowsAtOnce) {
    const std::size_t rows = std::min(kRowsAtOnce, num_a - first);
    const std::int16_t* four = a.data() + first * kSiftSize;
    std::array<std::int16_t, kRowsAtOnce * kSiftSize> last{};
    if (rows < kRowsAtOnce) {
      std::copy_n(four, rows * kSiftSize, last.begin());
      four = last.data();
    }
    MultiplyFour(four, b.data(), num_b, stride, products->data());
    for (std::size_t row = 0; row < rows; ++row) {
      TakeRow(products->data() + row * stride, stride, first + row, &found->of_a, &found->of_b);
    }
  }
}

#if MONO3D_WITH_AVX2
[[gnu::target("avx2")]] void FindAllWithAvx2(const DescriptorMatrix& a, std::size_t num_a,
                                             const DescriptorMatrix& b, std::size_t num_b,
                                             std::size_t stride,
                                             std::vector<std::int32_t>* products,
                                             SimilarFeatures* found) {
  FindAll(a, num_a, b, num_b, stride, products, found);
}
#endif

}  // namespace

DescriptorRow ToDescriptor(const SiftVector& unit) {
  constexpr float kUnit = 1 << 14;
  return (kUnit * unit).array().round().cast<std::int16_t>();
}

std::int32_t DescriptorProduct(const DescriptorMatrix& a, Eigen::Index row_a,
                               const DescriptorMatrix& b, Eigen::Index row_b) {
  const std::int16_t* of_a = a.data() + row_a * kSiftSize;
  const std::int16_t* of_b = b.data() + row_b * kSiftSize;
  std::int32_t sum = 0;
  for (int d = 0; d < kSiftSize; ++d) sum += of_a[d] * of_b[d];
  return sum;
}

SimilarFeatures FindMostSimilar(const DescriptorMatrix& a, std::size_t num_a,
                                const DescriptorMatrix& b, std::size_t num_b,
                                [[maybe_unused]] bool may_use_avx2) {
  const std::size_t stride = (num_b + kLanes - 1) / kLanes * kLanes;
  SimilarFeatures found{MostSimilar(num_a), MostSimilar(stride)};
  std::vector<std::int32_t> products(kRowsAtOnce * stride, -1);  // -1 where b has no feature
#if MONO3D_WITH_AVX2
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (may_use_avx2 && has_avx2) {
    FindAllWithAvx2(a, num_a, b, num_b, stride, &products, &found);
    return found;
  }
#endif
  FindAll(a, num_a, b, num_b, stride, &products, &found);
  return found;
}

}  // namespace mono3d::tracking
