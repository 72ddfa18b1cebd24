// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/image_noise.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "depth/min_response.h"
#include "mono3d/depth/depth_estimator.h"
#include "reference/depth/dog_reference.h"

namespace mono3d {
namespace {

constexpr double kTolerance = 0.1;  // share of the noise: of its estimate from a few hundred pixels
// Of the flattest blocks of 256 pixels of one noise: two standard deviations of 6 % and a little.
constexpr double kFlatTolerance = 0.15;

// Grey ramp with noise; on its left half rough texture where that is wanted.
cv::Mat NoisyImage(double sigma, bool with_texture) {
  cv::RNG random(3);
  cv::Mat image(160, 256, CV_32FC1);
  for (int x = 0; x < image.cols; ++x) image.col(x) = 60 + 0.4 * x;
  cv::Mat noise(image.size(), CV_32FC1);
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  image += noise;
  if (with_texture) {
    cv::Mat texture(image.size(), CV_32FC1);
    random.fill(texture, cv::RNG::NORMAL, 0, 30);
    image.colRange(0, 200) += texture.colRange(0, 200);
  }
  image.convertTo(image, CV_8U);
  return image;
}

TEST(ImageNoise, IsThatWhichWasAdded) {
  for (const double sigma : {1.0, 2.0, 4.0}) {
    const ImageNoise noise = MeasureNoise(NoisyImage(sigma, false));
    EXPECT_NEAR(noise.typical, sigma, kTolerance * sigma);
    EXPECT_NEAR(noise.flat, sigma, kFlatTolerance * sigma);
  }
}

TEST(ImageNoise, OfFlatPartsDoesNotGrowWithTextureElsewhere) {
  const ImageNoise noise = MeasureNoise(NoisyImage(2, true));
  EXPECT_NEAR(noise.flat, 2, 2 * kFlatTolerance);
  EXPECT_GT(noise.typical, 10);
}

TEST(ImageNoise, OfAnImageThatIsNowhereButGreyIsThatOfRounding) {
  const ImageNoise noise = MeasureNoise(cv::Mat(40, 40, CV_8UC1, cv::Scalar(128)));
  EXPECT_EQ(noise.typical, 0.29);
  EXPECT_EQ(noise.flat, 0.29);
  EXPECT_EQ(MeasureNoise(cv::Mat(5, 5, CV_8UC1, cv::Scalar(0))).flat, 0.29);
}

// Mean response over census windows, grey levels, of every fifth window.
double ShareOfWindowsAbove(double least, const cv::Mat& grey) {
  const std::vector<std::uint32_t> response = reference::DogResponse(grey);
  int num = 0, num_above = 0;
  for (int y = 8; y < grey.rows - 8; y += 5) {
    for (int x = 8; x < grey.cols - 8; x += 5) {
      double sum = 0;
      for (int dy = -3; dy <= 3; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
          sum += response[static_cast<std::size_t>((y + dy) * grey.cols + x + dx)];
        }
      }
      ++num;
      num_above += sum / 63 / 256 > least ? 1 : 0;
    }
  }
  return static_cast<double>(num_above) / num;
}

TEST(ImageNoise, AloneIsNoTextureHoweverStrong) {
  const DogOptions dog;
  for (const double sigma : {0.3, 1.0, 2.0, 4.0}) {
    const cv::Mat grey = NoisyImage(sigma, false);
    EXPECT_LT(ShareOfWindowsAbove(MinResponse(dog, MeasureNoise(grey)), grey), 0.01) << sigma;
  }
  EXPECT_GT(ShareOfWindowsAbove(dog.min_response, NoisyImage(4, false)), 0.9);
  // As fine as noise, but stronger than that of any camera.
  const cv::Mat sand = NoisyImage(30, false);
  EXPECT_GT(ShareOfWindowsAbove(MinResponse(dog, MeasureNoise(sand)), sand), 0.99);
  const cv::Mat textured = NoisyImage(4, true).colRange(0, 190);
  EXPECT_GT(ShareOfWindowsAbove(MinResponse(dog, {.typical = 20, .flat = 4}), textured), 0.99);
}

}  // namespace
}  // namespace mono3d
