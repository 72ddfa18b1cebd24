// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/undistorter.h"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

CameraModel LensCamera(const std::array<double, 5>& distortion) {
  return {160, 120, 120, 118, 78.5, 61.25, distortion};
}

const std::array<double, 5> kLenses[] = {
    {-0.25, 0.06, 0.001, -0.002, 0}, {0.2, -0.05, 0, 0, 0.01}, {0.04, 0, 0, 0, 0}};

// Where a camera with distortion sees a direction (OpenCV's model, Brown 1966).
Eigen::Vector2d ProjectDistorted(const CameraModel& camera, double x, double y) {
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {camera.fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + camera.cx,
          camera.fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + camera.cy};
}

// Brightness by place: its gradient is slow enough for linear interpolation to be exact to a level.
double Brightness(const Eigen::Vector2d& pixel) {
  return 127 + 60 * std::sin(pixel.x() / 20) + 60 * std::cos(pixel.y() / 20);
}

TEST(Undistorter, LeavesAnImageWithoutDistortionAlone) {
  const CameraModel camera = LensCamera({});
  const Undistorter undistorter(camera);
  EXPECT_EQ(undistorter.camera(), camera);
  const cv::Mat image(camera.height, camera.width, CV_8UC3, cv::Scalar(1, 2, 3));
  EXPECT_EQ(undistorter.Undistort(image).data, image.data);
}

TEST(Undistorter, GivesEachPixelTheBrightnessOfItsDirection) {
  for (const auto& distortion : kLenses) {
    const CameraModel camera = LensCamera(distortion);
    cv::Mat image(camera.height, camera.width, CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(Brightness({x, y}));
      }
    }
    const Undistorter undistorter(camera);
    const cv::Mat straight = undistorter.Undistort(image);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const Eigen::Vector3d direction = undistorter.camera().Unproject({x, y});
        const Eigen::Vector2d seen = ProjectDistorted(camera, direction.x(), direction.y());
        // A wrong position by half a pixel would differ by up to 1.5 levels plus rounding; twice
        // the rounding to whole levels is allowed.
        ASSERT_NEAR(straight.at<std::uint8_t>(y, x), Brightness(seen), 1.2) << x << " " << y;
      }
    }
  }
}

// The image of a straight line of the scene is bent by the lens and straight afterwards.
TEST(Undistorter, StraightensALine) {
  const CameraModel camera = LensCamera({-0.25, 0.06, 0, 0, 0});
  cv::Mat image(camera.height, camera.width, CV_8UC1, cv::Scalar(0));
  // The line x = -0.5 at z = 1, drawn with soft edges of a width that linear sampling resolves.
  constexpr double kLineX = -0.5;
  constexpr double kHalfWidth_px = 2.5;
  for (int y = 0; y < image.rows; ++y) {
    double line_px = 0;
    double nearest = 1e9;
    for (double t = -0.8; t < 0.8; t += 1e-4) {
      const Eigen::Vector2d pixel = ProjectDistorted(camera, kLineX, t);
      if (std::abs(pixel.y() - y) > nearest) continue;
      nearest = std::abs(pixel.y() - y);
      line_px = pixel.x();
    }
    for (int x = 0; x < image.cols; ++x) {
      const double cover = 1 - std::abs(x - line_px) / kHalfWidth_px;
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(250 * cover);
    }
  }
  const auto centre_of_row = [](const cv::Mat& picture, int y) {
    double sum = 0;
    double weighted = 0;
    for (int x = 0; x < picture.cols; ++x) {
      sum += picture.at<std::uint8_t>(y, x);
      weighted += x * picture.at<std::uint8_t>(y, x);
    }
    return weighted / sum;
  };
  const Undistorter undistorter(camera);
  const cv::Mat straight = undistorter.Undistort(image);
  const double expected_px = undistorter.camera().Project({kLineX, 0, 1}).x();
  double bend_before_px = 0;
  for (int y = 0; y < straight.rows; ++y) {
    // Rounding of brightness and of the maps; a tenth of what the eye can see.
    EXPECT_NEAR(centre_of_row(straight, y), expected_px, 0.1) << y;
    bend_before_px = std::max(
        bend_before_px, std::abs(centre_of_row(image, y) - centre_of_row(image, image.rows / 2)));
  }
  EXPECT_GT(bend_before_px, 1.5) << "the line was not bent";
}

constexpr double kMapStep_px = 1.0 / 32;

TEST(Undistorter, HasContentInEveryPixelAndLosesNoneItCouldKeep) {
  for (const auto& distortion : kLenses) {
    const CameraModel camera = LensCamera(distortion);
    const CameraModel straight = Undistorter(camera).camera();
    double left = 1e9;
    double right = -1e9;
    for (int y = 0; y < straight.height; ++y) {
      for (const int x : {0, straight.width - 1}) {
        const Eigen::Vector3d direction = straight.Unproject({x, y});
        const Eigen::Vector2d seen = ProjectDistorted(camera, direction.x(), direction.y());
        EXPECT_TRUE(camera.Contains(seen, -1e-6)) << seen.transpose();
        left = std::min(left, seen.x());
        right = std::max(right, seen.x());
      }
    }
    // The outermost columns are reached, within the step to which OpenCV rounds its maps.
    EXPECT_LT(left, kMapStep_px);
    EXPECT_GT(right, camera.width - 1 - kMapStep_px);
  }
}

TEST(Undistorter, RefusesCoefficientsThatFoldTheImage) {
  EXPECT_THAT(
      [] {
        Undistorter(LensCamera({-2, 0, 0, 0, 0}));
      },
      ThrowsMessage<Error>(HasSubstr("distortion coefficients do not describe a lens")));
  EXPECT_THAT(
      [] {
        Undistorter(LensCamera({5, -30, 0, 0, 0}));
      },
      ThrowsMessage<Error>(HasSubstr("distortion coefficients do not describe a lens")));
}

TEST(Undistorter, RefusesAnImageOfAnotherSize) {
  const Undistorter undistorter(LensCamera({0.1, 0, 0, 0, 0}));
  EXPECT_THAT([&] { undistorter.Undistort(cv::Mat(10, 10, CV_8UC3)); },
              ThrowsMessage<Error>(HasSubstr("(expected 160x120, found 10x10)")));
}

}  // namespace
}  // namespace mono3d
