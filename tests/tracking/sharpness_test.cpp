// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/sharpness.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

const Sequence& SharpFlight() {
  static const Sequence sequence = FlyOver(TexturedGround(true), 20);
  return sequence;
}

double SharpnessOf(const cv::Mat& grey) { return LogSharpness(BuildOctaves(grey)); }

cv::Mat BlurredAlongRows(const cv::Mat& grey, int length_px) {
  cv::Mat blurred;
  cv::blur(grey, blurred, cv::Size(length_px, 1));
  return blurred;
}

TEST(LogSharpness, FallsWithMotionBlur) {
  const cv::Mat grey = ToGrey(SharpFlight().frames[0].bgr);
  double before = SharpnessOf(grey);
  for (const int length_px : {3, 5, 9}) {
    const double after = SharpnessOf(BlurredAlongRows(grey, length_px));
    EXPECT_LT(after, before - 0.05) << length_px;
    before = after;
  }
}

TEST(LogSharpness, DoesNotFollowTheExposure) {
  const cv::Mat grey = ToGrey(SharpFlight().frames[0].bgr);
  cv::Mat darker;
  grey.convertTo(darker, CV_8U, 0.6, 10);
  EXPECT_NEAR(SharpnessOf(darker), SharpnessOf(grey), 0.01);
}

TEST(LogSharpness, OfAnImageWithoutGradientIsZero) {
  EXPECT_EQ(SharpnessOf(cv::Mat(200, 300, CV_8UC1, cv::Scalar(90))), 0);
  EXPECT_EQ(SharpnessOf(cv::Mat(20, 30, CV_8UC1, cv::Scalar(90))), 0);
}

TEST(SharpnessHistory, DoesNotCompareWithFewImages) {
  SharpnessHistory history;
  for (int i = 0; i < 4; ++i) history.Add(0);
  EXPECT_FALSE(history.IsBlurred(-1));
  EXPECT_FALSE(history.IsSharp(1));
  history.Add(0);
  EXPECT_TRUE(history.IsBlurred(-1));
  EXPECT_TRUE(history.IsSharp(1));
  history.Clear();
  EXPECT_FALSE(history.IsBlurred(-1));
}

// Clean flights differ by no more than what is in view.
TEST(SharpnessHistory, CallsNoImageOfASharpFlightBlurredOrSharp) {
  SharpnessHistory history;
  for (std::size_t i = 0; i < 20; ++i) {
    const double sharpness = SharpnessOf(ToGrey(SharpFlight().frames[i].bgr));
    EXPECT_FALSE(history.IsBlurred(sharpness)) << i;
    EXPECT_FALSE(history.IsSharp(sharpness)) << i;
    history.Add(sharpness);
  }
}

TEST(SharpnessHistory, TellsBlurredFromSharpWhereTheyAlternate) {
  SharpnessHistory history;
  std::vector<double> sharp;
  std::vector<double> blurred;
  for (std::size_t i = 0; i < 12; ++i) {
    const cv::Mat grey = ToGrey(SharpFlight().frames[i].bgr);
    sharp.push_back(SharpnessOf(grey));
    blurred.push_back(SharpnessOf(BlurredAlongRows(grey, 7)));
  }
  for (std::size_t i = 0; i < 10; ++i) history.Add(i % 2 == 0 ? sharp[i] : blurred[i]);
  history.Add(sharp[10]);
  EXPECT_TRUE(history.IsBlurred(blurred[11]));
  EXPECT_FALSE(history.IsSharp(blurred[11]));
  EXPECT_FALSE(history.IsBlurred(sharp[11]));
  for (std::size_t i = 0; i < 6; ++i) history.Add(blurred[i]);
  EXPECT_FALSE(history.IsBlurred(blurred[11]));  // as all others are
  EXPECT_TRUE(history.IsSharp(sharp[0]));
}

}  // namespace
}  // namespace mono3d::tracking
