// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/confidence_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kErrorFloat = 1e-6;  // errors are stored as float
constexpr int kNumPixels = 10;

// Errors 0.1 to 1.0.
cv::Mat Errors() {
  cv::Mat errors(1, kNumPixels, CV_32FC1);
  for (int i = 0; i < kNumPixels; ++i) errors.at<float>(i) = 0.1F * static_cast<float>(i + 1);
  return errors;
}

TEST(ConfidenceCalibration, OfAPerfectConfidenceIsTheOracle) {
  const ConfidenceCalibration calibration = CalibrateConfidence(Errors(), 1 - Errors());
  EXPECT_EQ(calibration.num_pixels, kNumPixels);
  EXPECT_NEAR(calibration.mean_error, 0.55, kErrorFloat);
  EXPECT_NEAR(calibration.area_to_oracle, 0, kErrorFloat);
  // Without the tenth: the mean of 0.1 to 0.9 is 0.5.
  EXPECT_NEAR(calibration.error_left[10], 0.5, kErrorFloat);
  EXPECT_NEAR(calibration.error_removed_by_worst_tenth, 1 - 0.5 / 0.55, kErrorFloat);
  // Half of a pixel dropped: 0.55 * 10 - 0.5 * 1.0 over 9.5.
  EXPECT_NEAR(calibration.error_left[5], 5.0 / 9.5, kErrorFloat);
  EXPECT_NEAR(calibration.error_left[99], 0.1, kErrorFloat);
  EXPECT_NEAR(calibration.error_left_oracle[50], 0.3, kErrorFloat);
}

TEST(ConfidenceCalibration, OfAConfidenceThatIsWrongRemovesLessThanNothing) {
  const ConfidenceCalibration calibration = CalibrateConfidence(Errors(), Errors());
  EXPECT_NEAR(calibration.error_left[10], 0.6, kErrorFloat);  // without the best: 0.2 to 1.0
  EXPECT_LT(calibration.error_removed_by_worst_tenth, 0);
  EXPECT_GT(calibration.area_to_oracle, calibration.random_area_to_oracle);
}

TEST(ConfidenceCalibration, OfAConfidenceThatIsAllTheSameIsThatOfChance) {
  const cv::Mat level(1, kNumPixels, CV_32FC1, cv::Scalar(0.5));
  const ConfidenceCalibration calibration = CalibrateConfidence(Errors(), level);
  for (const double left : calibration.error_left) EXPECT_NEAR(left, 0.55, kErrorFloat);
  EXPECT_NEAR(calibration.error_removed_by_worst_tenth, 0, kErrorFloat);
  EXPECT_NEAR(calibration.area_to_oracle, calibration.random_area_to_oracle, kErrorFloat);
  EXPECT_GT(calibration.random_area_to_oracle, 0.1);
}

TEST(ConfidenceCalibration, HasTheAreaWorkedOutByHand) {
  // Two pixels, errors 0 and 1, confidence the wrong way round. With a share d dropped the oracle
  // leaves (0.5 - d) / (1 - d) up to d = 0.5, then 0; the other min(0.5 / (1 - d), 1).
  // Area: the integral of 0.5 / (1 - d) - (0.5 - d) / (1 - d) = d / (1 - d) from 0 to 0.5, ln 2 -
  // 0.5, and 0.5 for the rest, by the mean error 0.5: 2 ln 2.
  const cv::Mat errors = (cv::Mat_<float>(1, 2) << 0, 1);
  const ConfidenceCalibration calibration = CalibrateConfidence(errors, errors);
  constexpr double kTrapezoids = 1e-3;  // of a hundred steps
  EXPECT_NEAR(calibration.area_to_oracle, 2 * std::log(2.0), kTrapezoids);
}

TEST(ConfidenceCalibration, LeavesOutPixelsWithoutAnError) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat errors = (cv::Mat_<float>(1, 3) << 0.1F, nan, 0.3F);
  const cv::Mat confidence = (cv::Mat_<float>(1, 3) << 1, nan, 0);
  const ConfidenceCalibration calibration = CalibrateConfidence(errors, confidence);
  EXPECT_EQ(calibration.num_pixels, 2);
  EXPECT_NEAR(calibration.mean_error, 0.2, kErrorFloat);
  EXPECT_EQ(CalibrateConfidence(errors.col(1), confidence.col(1)).num_pixels, 0);
}

TEST(ConfidenceCalibration, OfNoErrorAtAllIsZero) {
  const cv::Mat zero(2, 2, CV_32FC1, cv::Scalar(0));
  const ConfidenceCalibration calibration = CalibrateConfidence(zero, zero);
  EXPECT_EQ(calibration.num_pixels, 4);
  EXPECT_EQ(calibration.area_to_oracle, 0);
  EXPECT_EQ(calibration.error_removed_by_worst_tenth, 0);
}

TEST(ConfidenceCalibration, OfManyMapsIsTheMeanOverThoseWithPixels) {
  const ConfidenceCalibration good = CalibrateConfidence(Errors(), 1 - Errors());
  const ConfidenceCalibration bad = CalibrateConfidence(Errors(), Errors());
  const ConfidenceCalibration mean =
      MeanCalibration(std::vector<ConfidenceCalibration>{good, {}, bad});
  EXPECT_EQ(mean.num_pixels, 2 * kNumPixels);
  EXPECT_NEAR(mean.area_to_oracle, (good.area_to_oracle + bad.area_to_oracle) / 2, kErrorFloat);
  EXPECT_NEAR(mean.error_left[10], 0.55, kErrorFloat);
  EXPECT_TRUE(MeanCalibration({}).error_left.empty());
}

TEST(ConfidenceCalibration, RefusesAnotherSizeAndAConfidenceThatIsNotFinite) {
  EXPECT_THROW(CalibrateConfidence(Errors(), cv::Mat(2, 2, CV_32FC1, cv::Scalar(1))), Error);
  cv::Mat confidence = 1 - Errors();
  confidence.at<float>(3) = std::numeric_limits<float>::infinity();
  EXPECT_THROW(CalibrateConfidence(Errors(), confidence), Error);
}

}  // namespace
}  // namespace mono3d
