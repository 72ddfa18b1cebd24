// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/similarity.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "geometry/two_view_world.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kSimilarityRounding =
    1e-10;  // some operations in double precision on numbers near 10

const Similarity kSimilarity(2.5, Pose(RotationExp({0.3, -0.8, 0.2}), Eigen::Vector3d(1, 2, -3)));

TEST(Similarity, ScalesThenRotatesThenMoves) {
  const Similarity S(3, Pose(RotationExp({0, 0, 0}), Eigen::Vector3d(0, 1, 0)));
  EXPECT_LT((S * Eigen::Vector3d(1, 1, 1) - Eigen::Vector3d(3, 4, 3)).norm(), kSimilarityRounding);
}

TEST(Similarity, TimesItsInverseIsIdentity) {
  const Eigen::Vector3d p(4, -5, 6);
  EXPECT_LT((kSimilarity.Inverse() * (kSimilarity * p) - p).norm(), kSimilarityRounding);
  const Similarity product = kSimilarity * kSimilarity.Inverse();
  EXPECT_NEAR(product.scale(), 1, kSimilarityRounding);
  EXPECT_LT((product * p - p).norm(), kSimilarityRounding);
}

TEST(Similarity, MovesACameraWithItsPoints) {
  // What the camera sees keeps its direction and grows with the scale.
  const Pose T_b_cam(RotationExp({-0.1, 0.5, 0.3}), Eigen::Vector3d(0.2, 0.4, 0.6));
  const Eigen::Vector3d p_b(3, 2, 9);
  const Eigen::Vector3d seen = T_b_cam.Inverse() * p_b;
  const Eigen::Vector3d seen_after = (kSimilarity * T_b_cam).Inverse() * (kSimilarity * p_b);
  EXPECT_LT((seen_after - kSimilarity.scale() * seen).norm(), kSimilarityRounding);
}

TEST(FitSimilarity, FindsTheSimilarityOfExactPairs) {
  std::mt19937 random(SeedFromTestName());
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;
  for (int i = 0; i < 10; ++i) {
    source.emplace_back(Normal(random, 4), Normal(random, 4), Normal(random, 4));
    target.push_back(kSimilarity * source.back());
  }
  const Similarity fit = FitSimilarity(source, target);
  EXPECT_NEAR(fit.scale(), kSimilarity.scale(), kSimilarityRounding);
  EXPECT_LT((fit.pose().Matrix() - kSimilarity.pose().Matrix()).norm(), kSimilarityRounding);
}

TEST(FitSimilarity, RefusesTooFewOrCoincidingPoints) {
  const std::vector<Eigen::Vector3d> two(2, Eigen::Vector3d(1, 2, 3));
  const std::vector<Eigen::Vector3d> three(3, Eigen::Vector3d(1, 2, 3));
  EXPECT_THROW(static_cast<void>(FitSimilarity(two, two)), Error);
  EXPECT_THROW(static_cast<void>(FitSimilarity(three, two)), Error);
  EXPECT_THROW(static_cast<void>(FitSimilarity(three, three)), Error);
}

}  // namespace
}  // namespace mono3d
