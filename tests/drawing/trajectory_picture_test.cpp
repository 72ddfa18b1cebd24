// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/trajectory_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

// Half an ellipse in the plane z = 0, seen by cameras that look down.
std::vector<StampedPose> BentFlight(double size) {
  const Eigen::Quaterniond down(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  std::vector<StampedPose> poses;
  for (int i = 0; i <= 120; ++i) {
    const double angle = std::numbers::pi * i / 120;
    const Eigen::Vector3d position(3 * std::cos(angle), std::sin(angle), 0);
    poses.push_back({0.1 * i, Pose(down, size * position)});
  }
  return poses;
}

// The second half of the flight 0.1 off sideways.
std::vector<StampedPose> Estimate(double size) {
  std::vector<StampedPose> poses = BentFlight(size);
  for (std::size_t i = poses.size() / 2; i < poses.size(); ++i) {
    Pose& pose = poses[i].T_world_cam;
    pose = Pose(pose.rotation(), pose.translation() + Eigen::Vector3d(0, 0.1 * size, 0));
  }
  return poses;
}

cv::Mat Draw(double size) {
  TrajectoryErrorOptions options;
  options.align = "none";
  return TrajectoryPicture(CompareTrajectories(Estimate(size), BentFlight(size), options),
                           BentFlight(size));
}

// Inside the axes.
cv::Mat Inside(const cv::Mat& picture) {
  return picture(cv::Rect(cv::Point(86, 66), cv::Point(picture.cols - 122, picture.rows - 64)));
}

// The mean column of the pixels of this colour; nothing: -1.
double MeanColumn(const cv::Mat& picture, const cv::Vec3b& colour) {
  double sum = 0;
  double count = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (cv::norm(picture.at<cv::Vec3b>(y, x), colour, cv::NORM_INF) > 3) continue;
      sum += x;
      ++count;
    }
  }
  return count > 0 ? sum / count : -1;
}

TEST(TrajectoryPicture, ColoursTheEstimateByItsErrorWhereItIs) {
  const cv::Mat picture = Draw(1);
  EXPECT_EQ(picture.size(), cv::Size(960, 720));
  const cv::Mat inside = Inside(picture);
  // x to the right: the flight goes from right to left, and its second half is off.
  const double exact = MeanColumn(inside, MapColour(cv::COLORMAP_TURBO, 0));
  const double off = MeanColumn(inside, MapColour(cv::COLORMAP_TURBO, 1));
  EXPECT_GT(exact, inside.cols / 2);
  EXPECT_GT(off, 0);
  EXPECT_LT(off, inside.cols / 2);
}

TEST(TrajectoryPicture, IsSeenFromAboveWithTheWorldsXToTheRight) {
  // The truth, grey, bows upwards in the picture: y is ahead when z is up.
  const cv::Mat inside = Inside(Draw(1));
  const cv::Vec3b grey(130, 130, 130);
  const cv::Mat middle = inside.colRange(inside.cols * 45 / 100, inside.cols * 55 / 100);
  const cv::Mat end = inside.colRange(inside.cols * 85 / 100, inside.cols);
  const double row_of_middle = MeanColumn(middle.t(), grey);
  const double row_of_end = MeanColumn(end.t(), grey);
  EXPECT_GT(row_of_middle, 0);
  EXPECT_LT(row_of_middle, row_of_end);
}

TEST(TrajectoryPicture, DoesNotDependOnTheScaleOfTheWorld) {
  // A power of ten, so that the ticks stand at the same places; rounding moves lines by 1/16 px.
  cv::Mat difference;
  cv::absdiff(Inside(Draw(1)), Inside(Draw(1000)), difference);
  EXPECT_LT(cv::mean(difference.reshape(1))[0], 0.1);
}

TEST(TrajectoryPicture, MayBeOfOnePose) {
  TrajectoryErrorOptions options;
  options.align = "none";
  const std::vector<StampedPose> one(1);
  EXPECT_NO_THROW(TrajectoryPicture(CompareTrajectories(one, one, options), one));
}

TEST(TrajectoryPicture, RefusesATinyPictureAndNoTruth) {
  const TrajectoryError error = CompareTrajectories(BentFlight(1), BentFlight(1));
  EXPECT_THROW(TrajectoryPicture(error, BentFlight(1), {.width_px = 100}), Error);
  EXPECT_THROW(TrajectoryPicture(error, {}), Error);
}

TEST(Ticks, AreRoundAndWithinTheirRange) {
  EXPECT_EQ(Ticks(-0.3, 10.2, 6), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(Ticks(0, 0, 6), std::vector<double>{0});
  const std::vector<double> fine = Ticks(0, 0.05, 5);
  EXPECT_EQ(fine.size(), 6U);
  EXPECT_EQ(TickText(fine[3], fine), "0.03");
  EXPECT_EQ(TickText(200, Ticks(0, 1000, 5)), "200");
}

}  // namespace
}  // namespace mono3d::tools
