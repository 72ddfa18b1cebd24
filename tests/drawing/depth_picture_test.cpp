// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/depth_picture.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "drawing/chart.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

constexpr int kWidth = 200;
constexpr int kHeight = 120;
const DepthPictureOptions kOptions = {.panel_width_px = kWidth};
const cv::Vec3b kNothing(200, 200, 200);

// Panels are as large as the maps here, so that each pixel is to be found again.
cv::Mat Panel(const cv::Mat& picture, int i) {
  return picture(cv::Rect(12 + i * (kWidth + 12), 30, kWidth, kHeight));
}

cv::Mat Ramp() {
  cv::Mat depth(kHeight, kWidth, CV_32FC1);
  for (int x = 0; x < kWidth; ++x) depth.col(x) = 10 + 0.1 * x;
  return depth;
}

double Difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(DepthPicture, ShowsEstimateAndTruthInTheSameColours) {
  const cv::Mat estimate = Ramp() / 2;
  const cv::Mat picture = DepthPicture(estimate, Ramp(), 2, kOptions);
  EXPECT_EQ(picture.type(), CV_8UC3);
  EXPECT_EQ(Difference(Panel(picture, 0), Panel(picture, 1)), 0);
  const cv::Mat black(kHeight, kWidth, CV_8UC3, cv::Scalar(MapColour(cv::COLORMAP_MAGMA, 0)));
  EXPECT_LE(Difference(Panel(picture, 2), black), 1);  // rounding of the last digit
  // Near is red, far is blue.
  const auto near = Panel(picture, 1).at<cv::Vec3b>(60, 5);
  const auto far = Panel(picture, 1).at<cv::Vec3b>(60, 194);
  EXPECT_GT(near[2], near[0]);
  EXPECT_GT(far[0], far[2]);
}

TEST(DepthPicture, ShowsTheErrorOnItsScale) {
  cv::Mat estimate = Ramp();
  estimate.rowRange(0, 60) *= 1.10;
  DepthPictureOptions options = kOptions;
  options.max_relative_error = 0.2;
  const cv::Mat errors = Panel(DepthPicture(estimate, Ramp(), 1, options), 2);
  EXPECT_LE(Difference(errors.row(30).col(100),
                       cv::Mat(1, 1, CV_8UC3, cv::Scalar(MapColour(cv::COLORMAP_MAGMA, 0.5)))),
            2);
}

TEST(DepthPicture, IsLightGreyWhereThereIsNothing) {
  cv::Mat estimate = Ramp();
  estimate.rowRange(0, 60).setTo(0);
  cv::Mat truth = Ramp();
  truth.colRange(0, 50).setTo(0);
  const cv::Mat picture = DepthPicture(estimate, truth, 1, kOptions);
  EXPECT_EQ(Panel(picture, 0).at<cv::Vec3b>(30, 100), kNothing);
  EXPECT_NE(Panel(picture, 0).at<cv::Vec3b>(90, 20), kNothing);
  EXPECT_EQ(Panel(picture, 1).at<cv::Vec3b>(90, 20), kNothing);
  EXPECT_EQ(Panel(picture, 2).at<cv::Vec3b>(30, 100), kNothing);
  EXPECT_EQ(Panel(picture, 2).at<cv::Vec3b>(90, 20), kNothing);
  EXPECT_NE(Panel(picture, 2).at<cv::Vec3b>(90, 100), kNothing);
}

TEST(DepthPicture, DoesNotDependOnTheUnit) {
  DepthPictureOptions options = kOptions;
  const cv::Mat estimate = Ramp() * 1.01;
  const cv::Mat picture = DepthPicture(estimate, Ramp(), 1, options);
  const cv::Mat larger = DepthPicture(estimate * 1024, Ramp() * 1024, 1, options);
  for (int i = 0; i < 3; ++i) EXPECT_LE(Difference(Panel(picture, i), Panel(larger, i)), 16) << i;
}

TEST(DepthPicture, MayHaveNothingToShow) {
  const cv::Mat none(kHeight, kWidth, CV_32FC1, cv::Scalar(0));
  EXPECT_EQ(Panel(DepthPicture(none, none, 1, kOptions), 2).at<cv::Vec3b>(9, 9), kNothing);
  EXPECT_NO_THROW(DepthPicture(none + 5, none + 5, 1, kOptions));
}

TEST(ConfidencePicture, RisesFromDarkToBright) {
  cv::Mat confidence(kHeight, kWidth, CV_32FC1);
  for (int x = 0; x < kWidth; ++x) confidence.col(x) = x / 199.0;
  const cv::Mat panel = Panel(ConfidencePicture(confidence, Ramp(), Ramp(), 1, kOptions), 0);
  const auto low = panel.at<cv::Vec3b>(60, 0);
  const auto high = panel.at<cv::Vec3b>(60, 199);
  EXPECT_EQ(low, MapColour(cv::COLORMAP_VIRIDIS, 0));
  EXPECT_EQ(high, MapColour(cv::COLORMAP_VIRIDIS, 1));
}

TEST(DepthPicture, RefusesOtherSizesAndNarrowPanels) {
  EXPECT_THROW(DepthPicture(Ramp(), Ramp().colRange(0, 50), 1, kOptions), Error);
  EXPECT_THROW(DepthPicture(Ramp(), Ramp(), 1, {.panel_width_px = 100}), Error);
  EXPECT_THROW(ConfidencePicture(Ramp().colRange(0, 50), Ramp(), Ramp(), 1, kOptions), Error);
}

}  // namespace
}  // namespace mono3d::tools
