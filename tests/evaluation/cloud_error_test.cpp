// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_error.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "evaluation/cloud_scenes.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_evaluation.h"
#include "mono3d/evaluation/cloud_transform.h"

namespace mono3d {
namespace {

constexpr double kFloatTolerance_m = 1e-6;  // floats at coordinates up to 10

PointCloud Points(const std::vector<Eigen::Vector3f>& points) {
  PointCloud cloud;
  cloud.points = points;
  return cloud;
}

TEST(CloudError, OfTwoPointCloudsIsThatWorkedOutByHand) {
  const PointCloud estimate = Points({{0, 0, 3}, {10, 0, 4}});
  const PointCloud truth = Points({{0, 0, 0}, {10, 0, 0}});
  const std::vector<double> thresholds = {3, 4, 0.5};
  const CloudError error = ComputeCloudError(estimate, truth, thresholds);
  EXPECT_NEAR(error.estimate_to_truth.rmse, std::sqrt(12.5), kFloatTolerance_m);  // (9 + 16) / 2
  EXPECT_NEAR(error.estimate_to_truth.mean, 3.5, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_to_truth.median, 3.5, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_to_truth.sigma, 0.5, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_to_truth.max, 4, kFloatTolerance_m);
  EXPECT_EQ(error.truth_to_estimate.count, 2);
  EXPECT_NEAR(error.truth_spacing_m, 10, kFloatTolerance_m);
  ASSERT_EQ(error.shares.size(), 3U);
  EXPECT_DOUBLE_EQ(error.shares[0].accuracy, 0.5);
  EXPECT_DOUBLE_EQ(error.shares[0].completeness, 0.5);
  EXPECT_DOUBLE_EQ(error.shares[0].f_score, 0.5);
  EXPECT_DOUBLE_EQ(error.shares[1].f_score, 1);
  EXPECT_DOUBLE_EQ(error.shares[2].f_score, 0);
}

TEST(CloudError, CountsBothWaysApart) {
  const PointCloud estimate = Points({{0, 0, 0}});
  const PointCloud truth = Points({{0, 0, 0}, {2, 0, 0}, {4, 0, 0}});
  const std::vector<double> thresholds = {1};
  const CloudError error = ComputeCloudError(estimate, truth, thresholds);
  EXPECT_DOUBLE_EQ(error.shares[0].accuracy, 1);
  EXPECT_DOUBLE_EQ(error.shares[0].completeness, 1.0 / 3);
  EXPECT_DOUBLE_EQ(error.shares[0].f_score, 0.5);  // 2 * (1 * 1/3) / (4/3)
  EXPECT_NEAR(error.truth_to_estimate.mean, 2, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_to_truth.max, 0, kFloatTolerance_m);
}

// A grid of points 1 m apart, and one point between four of them, 0.1 m above.
TEST(CloudError, ToThePlaneHasNoFloorButAHoleIsStillFar) {
  PointCloud truth;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 20; ++y) {
      truth.points.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
    }
  }
  const PointCloud estimate = Points({{5.5F, 5.5F, 0.1F}, {40, 5, 0}});
  const CloudError error = ComputeCloudError(estimate, truth, {});
  EXPECT_NEAR(error.truth_spacing_m, 1, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_distances_m[0], std::sqrt(0.51), kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_plane_distances_m[0], 0.1, kFloatTolerance_m);
  EXPECT_NEAR(error.estimate_plane_distances_m[1], 21, 1e-5);  // from the border at x = 19
}

TEST(CloudError, LeavingHalfOfTheTruthOutHalvesCompleteness) {
  const PointCloud truth = HouseCloud(10000, 1);
  PointCloud estimate;
  for (const Eigen::Vector3f& point : truth.points) {
    if (point.x() < 0) estimate.points.push_back(point);
  }
  const double share = static_cast<double>(estimate.size()) / static_cast<double>(truth.size());
  const std::vector<double> thresholds = {0.01};  // a twentieth of the spacing
  const CloudError error = ComputeCloudError(estimate, truth, thresholds);
  EXPECT_NEAR(share, 0.5, 0.05);
  EXPECT_DOUBLE_EQ(error.shares[0].accuracy, 1);
  EXPECT_NEAR(error.shares[0].completeness, share, 0.005);  // a point in 200 has one across the cut
}

TEST(CloudError, HasTheSameSharesInAWorldAThousandTimesAsLarge) {
  const PointCloud truth = HouseCloud(5000, 2);
  const PointCloud estimate = HouseCloud(5000, 3);
  const Similarity grow(1000, Pose());
  const CloudError small = ComputeCloudError(estimate, truth, CloudThresholds(15));
  const CloudError large = ComputeCloudError(TransformCloud(grow, estimate),
                                             TransformCloud(grow, truth), CloudThresholds(15000));
  ASSERT_EQ(small.shares.size(), 3U);
  constexpr double kOnePoint = 1.5 / 5000;  // rounding may put a point across a threshold
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GT(small.shares[i].accuracy, 0.1);
    EXPECT_NEAR(small.shares[i].accuracy, large.shares[i].accuracy, kOnePoint);
    EXPECT_NEAR(small.shares[i].completeness, large.shares[i].completeness, kOnePoint);
    EXPECT_NEAR(small.shares[i].accuracy_to_plane, large.shares[i].accuracy_to_plane, kOnePoint);
  }
  EXPECT_LT(small.shares[0].accuracy, small.shares[2].accuracy);
  EXPECT_NEAR(large.estimate_to_truth.rmse / small.estimate_to_truth.rmse, 1000, 0.01);
}

TEST(CloudError, RefusesWhatItCannotMeasure) {
  const PointCloud house = HouseCloud(100, 4);
  PointCloud broken = house;
  broken.points[3].x() = std::numeric_limits<float>::infinity();
  const std::vector<double> negative = {-1};
  EXPECT_THROW(ComputeCloudError({}, house, {}), Error);
  EXPECT_THROW(ComputeCloudError(house, {}, {}), Error);
  EXPECT_THROW(ComputeCloudError(broken, house, {}), Error);
  EXPECT_THROW(ComputeCloudError(house, house, negative), UsageError);
  EXPECT_THROW(CloudThresholds(0), UsageError);
}

TEST(CloudEvaluation, TakesThreeStepsToAScaledAndTurnedCloud) {
  const PointCloud truth = HouseCloud(20000, 5);
  const Similarity S_estimate_truth = TestSimilarity(30, 0.02, {1, 2, 3});
  const PointCloud estimate = TransformCloud(S_estimate_truth, HouseCloud(15000, 6, true));
  const Similarity start = TestSimilarity(2, 1.03, {0.1, 0.1, 0}) * S_estimate_truth.Inverse();
  const CloudEvaluation evaluation = EvaluateCloud(estimate, truth, start, CloudThresholds(15));
  EXPECT_DOUBLE_EQ(evaluation.rigid.S_truth_estimate.scale(), start.scale());
  EXPECT_NEAR(evaluation.S_truth_estimate.scale(), 50, 0.05);
  EXPECT_LT(evaluation.error.estimate_to_truth_plane.median, 0.01);
  EXPECT_GT(evaluation.error_at_start.estimate_to_truth_plane.median, 0.05);
  // One search in the estimate's own frame serves as well as one in the truth's.
  const CloudError moved =
      ComputeCloudError(evaluation.estimate_in_truth, truth, CloudThresholds(15));
  EXPECT_NEAR(evaluation.error.truth_to_estimate.rmse, moved.truth_to_estimate.rmse, 1e-5);
  EXPECT_NEAR(evaluation.error.estimate_to_truth_plane.rmse, moved.estimate_to_truth_plane.rmse,
              1e-5);
}

}  // namespace
}  // namespace mono3d
