// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/depth_error.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Depths are stored as float.
constexpr double kDepthFloat = 1e-6;

cv::Mat Row(const std::vector<float>& depths) {
  return cv::Mat(1, static_cast<int>(depths.size()), CV_32FC1, const_cast<float*>(depths.data()))
      .clone();
}

TEST(DepthError, OfTwoPixelsIsThatWorkedOutByHand) {
  const DepthError error = CompareDepth(Row({11, 18}), Row({10, 20}));
  EXPECT_EQ(error.num_pixels, 2);
  EXPECT_NEAR(error.rmse, std::sqrt(2.5), kDepthFloat);  // (1 + 4) / 2
  EXPECT_NEAR(error.l1_abs, 1.5, kDepthFloat);
  EXPECT_NEAR(error.l1_rel, 0.1, kDepthFloat);
  EXPECT_EQ(error.delta_125, 1);  // ratios 1.1 and 1.111
  EXPECT_EQ(error.delta_105, 0);
  EXPECT_EQ(error.density, 1);
  EXPECT_NEAR(error.mean_true_depth, 15, kDepthFloat);
}

TEST(DepthError, CountsTheSharesWithinEachFactor) {
  // Ratios 1.3, 1.2, 1 / 1.06, 1 / 1.02 and 1.001.
  const DepthError error =
      CompareDepth(Row({13, 12, 10, 10, 10.01F}), Row({10, 10, 10.6F, 10.2F, 10}));
  EXPECT_DOUBLE_EQ(error.delta_125, 0.8);
  EXPECT_DOUBLE_EQ(error.delta_110, 0.6);
  EXPECT_DOUBLE_EQ(error.delta_105, 0.4);
  EXPECT_DOUBLE_EQ(error.delta_101, 0.2);
}

TEST(DepthError, HasTheDensityOverPixelsWithATrueDepth) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const DepthError error = CompareDepth(Row({5, 0, kNan, -1, 7, 7}), Row({5, 5, 5, 5, 0, kNan}));
  EXPECT_EQ(error.num_true_pixels, 4);
  EXPECT_EQ(error.num_pixels, 1);
  EXPECT_EQ(error.density, 0.25);
  EXPECT_EQ(error.rmse, 0);
}

TEST(DepthError, LeavesOutWhatIsTrulyBeyondTheBound) {
  const DepthError error = CompareDepth(Row({10, 900}), Row({10, 301}), 1, 300);
  EXPECT_EQ(error.num_true_pixels, 1);
  EXPECT_EQ(error.l1_abs, 0);
}

TEST(DepthError, IsOfTheEstimateTimesTheScale) {
  const DepthError error = CompareDepth(Row({1, 2}), Row({10, 20}), 11);
  EXPECT_NEAR(error.l1_rel, 0.1, kDepthFloat);
  EXPECT_EQ(error.scale, 11);
  EXPECT_THROW(CompareDepth(Row({1}), Row({1}), 0), Error);
}

TEST(DepthError, RefusesMapsOfAnotherSizeOrType) {
  EXPECT_THAT(
      [] {
        CompareDepth(Row({1, 2}), Row({1}));
      },
      ThrowsMessage<Error>(HasSubstr("the estimated depth has another size or type (expected "
                                     "1x1 CV_32FC1, found 2x1 CV_32FC1)")));
  EXPECT_THROW(CompareDepth(cv::Mat(1, 1, CV_64FC1, cv::Scalar(1)), Row({1})), Error);
  EXPECT_THROW(CompareDepth(cv::Mat(), cv::Mat()), Error);
}

TEST(DepthScale, OfAMapIsTheQuotientOfMediansOverSharedPixels) {
  // Shared: the first three. Medians 6 and 2.
  EXPECT_DOUBLE_EQ(*MedianDepthScale(Row({1, 2, 3, 0, 9}), Row({6, 5, 7, 8, 0})), 2.5);
  EXPECT_FALSE(MedianDepthScale(Row({1, 0}), Row({0, 1})).has_value());
  EXPECT_DOUBLE_EQ(*MedianDepthScale(Row({1, 2}), Row({6, 500}), 300), 6);
}

TEST(DepthScale, TakesAnyUnitOfTheEstimateOut) {
  const cv::Mat truth = Row({10, 20, 30});
  for (const float unit : {1e-3F, 1.0F, 1e4F}) {
    const cv::Mat estimate = Row({11 * unit, 20 * unit, 29 * unit});
    const DepthError error = CompareDepth(estimate, truth, *MedianDepthScale(estimate, truth));
    EXPECT_NEAR(error.l1_abs, 2.0 / 3, 1e-5) << unit;
  }
}

// One wrong pixel moves the median depth from the near half to the far one.
TEST(DepthScale, IsThatOfMostPixelsWhereHalfIsNearAndHalfIsFar) {
  EXPECT_DOUBLE_EQ(*MedianDepthScale(Row({1, 1, 9, 10, 10}), Row({2, 2, 2, 20, 20})), 2);
}

TEST(DepthScale, OfARunIsTheMedianOfItsMaps) {
  EXPECT_EQ(RunDepthScale(std::vector<double>{3, 1, 100}), 3);
  EXPECT_THROW(RunDepthScale({}), Error);
  EXPECT_THROW(RunDepthScale(std::vector<double>{1, -1}), Error);
}

TEST(DepthError, OfManyMapsIsTheMeanOverThem) {
  const std::vector<DepthError> errors = {CompareDepth(Row({11, 0}), Row({10, 10})),
                                          CompareDepth(Row({13, 0}), Row({10, 0})),
                                          CompareDepth(Row({0, 0}), Row({20, 20}))};
  const MeanDepthError mean = ComputeMeanDepthError(errors);
  EXPECT_EQ(mean.num_maps, 3);
  EXPECT_EQ(mean.num_maps_compared, 2);
  EXPECT_NEAR(mean.mean.l1_rel, 0.2, kDepthFloat);
  EXPECT_NEAR(mean.mean.rmse, 2, kDepthFloat);
  EXPECT_NEAR(mean.mean.delta_125, 0.5, kDepthFloat);
  EXPECT_NEAR(mean.mean.density, 0.5, kDepthFloat);  // (0.5 + 1 + 0) / 3: a map with nothing counts
  EXPECT_NEAR(mean.mean.mean_true_depth, 40.0 / 3, kDepthFloat);
  EXPECT_EQ(mean.mean.num_pixels, 2);
  EXPECT_EQ(mean.mean.scale, 1);
  EXPECT_EQ(ComputeMeanDepthError({}).num_maps, 0);
}

TEST(RelativeDepthErrorImage, IsNotANumberWhereThereIsNothingToCompare) {
  const cv::Mat error = RelativeDepthErrorImage(Row({1, 0, 4}), Row({10, 10, 0}), 8);
  EXPECT_NEAR(error.at<float>(0, 0), 0.2, kDepthFloat);
  EXPECT_TRUE(std::isnan(error.at<float>(0, 1)));
  EXPECT_TRUE(std::isnan(error.at<float>(0, 2)));
}

}  // namespace
}  // namespace mono3d
