// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/residual_picture.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "reference/random.h"

namespace mono3d::tools {
namespace {

const CameraModel kCamera = {640, 480, 500, 500, 319.5, 239.5, {}};

// Noise, and a radial error that a wrong k1 would leave: outwards in the corners.
std::vector<CalibrationResidual> Residuals(double radial_px, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<CalibrationResidual> residuals;
  for (int i = 0; i < 8000; ++i) {
    const Eigen::Vector2d pixel(Uniform(random, 0, 639), Uniform(random, 0, 479));
    const Eigen::Vector2d way = (pixel - Eigen::Vector2d(319.5, 239.5)) / 400;
    const Eigen::Vector2d noise(Normal(random, 0.1), Normal(random, 0.1));
    residuals.push_back({pixel, radial_px * way * way.squaredNorm() + noise});
  }
  return residuals;
}

constexpr int kHeader = 76;
constexpr int kCellArea = 44 * 44;

// Below the text, and as thin lines with smooth borders are.
int NumRed(const cv::Mat& picture) {
  int count = 0;
  for (int y = kHeader; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto& pixel = picture.at<cv::Vec3b>(y, x);
      count += pixel[2] > pixel[1] + 60 ? 1 : 0;
    }
  }
  return count;
}

// Some pixels of the borders of arrows are as grey.
int NumGrey(const cv::Mat& picture) {
  const cv::Scalar no_data(235, 235, 235);
  cv::Mat is_equal;
  cv::inRange(picture.rowRange(kHeader, picture.rows), no_data, no_data, is_equal);
  return cv::countNonZero(is_equal);
}

TEST(ResidualFieldPicture, ShowsWhatIsMoreThanChanceInRed) {
  const cv::Mat chance = ResidualFieldPicture(Residuals(0, SeedFromTestName()), kCamera);
  const cv::Mat radial = ResidualFieldPicture(Residuals(0.5, SeedFromTestName()), kCamera);
  EXPECT_EQ(chance.type(), CV_8UC3);
  EXPECT_EQ(chance.size(), radial.size());
  EXPECT_GT(NumRed(radial), 1000);
  EXPECT_LT(NumRed(chance), NumRed(radial) / 10) << "a few of 300 arrows";
  EXPECT_LT(NumGrey(chance), kCellArea / 2);
}

TEST(ResidualFieldPicture, ShowsWhereNothingWasObserved) {
  std::vector<CalibrationResidual> residuals = Residuals(0, SeedFromTestName());
  std::erase_if(residuals, [](const auto& residual) { return residual.pixel.x() < 320; });
  const cv::Mat picture = ResidualFieldPicture(residuals, kCamera);
  EXPECT_GT(NumGrey(picture.colRange(0, picture.cols / 2)), 120 * kCellArea) << "of 150 cells";
  EXPECT_LT(NumGrey(picture.colRange(picture.cols / 2, picture.cols)), kCellArea / 2);
  EXPECT_FALSE(ResidualFieldPicture({}, kCamera).empty());
}

// The rows where the mark of the outermost ring of observations is.
double MeanRedRow(const cv::Mat& picture, int first_column, int last_column) {
  double sum = 0;
  double count = 0;
  for (int y = 80; y < picture.rows; ++y) {
    for (int x = first_column; x < last_column; ++x) {
      if (cv::norm(picture.at<cv::Vec3b>(y, x), cv::Vec3b(40, 40, 200), cv::NORM_INF) > 2) continue;
      sum += y;
      ++count;
    }
  }
  return count > 0 ? sum / count : -1;
}

TEST(ResidualByRadiusPicture, RisesWhereResidualsPointOutwards) {
  const cv::Mat picture = ResidualByRadiusPicture(Residuals(0.5, SeedFromTestName()), kCamera);
  const double inner = MeanRedRow(picture, 100, 500);
  const double outer = MeanRedRow(picture, 840, 900);
  ASSERT_GT(inner, 0);
  ASSERT_GT(outer, 0);
  EXPECT_LT(outer, inner - 100) << "upwards";
  const cv::Mat inwards = ResidualByRadiusPicture(Residuals(-0.5, SeedFromTestName()), kCamera);
  EXPECT_GT(MeanRedRow(inwards, 840, 900), MeanRedRow(inwards, 100, 500) + 100);
  EXPECT_FALSE(ResidualByRadiusPicture({}, kCamera).empty());
}

}  // namespace
}  // namespace mono3d::tools
