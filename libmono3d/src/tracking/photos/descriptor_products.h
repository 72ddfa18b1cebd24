// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mono3d::tracking {

constexpr int kSiftSize = 128;
using SiftVector = Eigen::Matrix<float, 1, kSiftSize>;

// Rows of unit length, times 2^14. Their products are cosines times 2^28: sums of integers, which
// do not depend on the order of summation and so not on the processor. A cosine is off by 1e-4 at
// most.
using DescriptorMatrix = Eigen::Matrix<std::int16_t, Eigen::Dynamic, kSiftSize, Eigen::RowMajor>;
using DescriptorRow = Eigen::Matrix<std::int16_t, 1, kSiftSize>;

constexpr double kProductOfUnit = 1 << 28;

DescriptorRow ToDescriptor(const SiftVector& unit);

// cosine * kProductOfUnit
std::int32_t DescriptorProduct(const DescriptorMatrix& a, Eigen::Index row_a,
                               const DescriptorMatrix& b, Eigen::Index row_b);

// Of each feature of one photo the two most similar ones of another, by the product of their
// descriptors.
struct MostSimilar {
  explicit MostSimilar(std::size_t size) : best(size, -1), second(size, -1), index(size, -1) {}

  void Take(std::size_t feature, std::int32_t product, std::int32_t other) {
    if (product > best[feature]) {
      second[feature] = best[feature];
      best[feature] = product;
      index[feature] = other;
    } else if (product > second[feature]) {
      second[feature] = product;
    }
  }

  std::vector<std::int32_t> best;    // -1: there is none
  std::vector<std::int32_t> second;  // -1: there is none
  std::vector<std::int32_t> index;   // of the best one; any of those that are as similar
};

struct SimilarFeatures {
  MostSimilar of_a;
  MostSimilar of_b;
};

// Among the first `num_a` features of one photo and the first `num_b` of another. The vectors of
// the result may be longer. The same with the instructions of AVX2, where the processor has them,
// and without. O(num_a num_b).
SimilarFeatures FindMostSimilar(const DescriptorMatrix& a, std::size_t num_a,
                                const DescriptorMatrix& b, std::size_t num_b,
                                bool may_use_avx2 = true);

}  // namespace mono3d::tracking
