// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

constexpr double kRounding = 0.29;  // 1 / sqrt(12)
constexpr double kGain = 6;         // root of the sum of the squared weights of the kernel
constexpr double kMedianOfNormal = 0.6745;
constexpr double kMeanOfNormal = 0.7979;  // sqrt(2 / pi)
constexpr int kBlock_px = 16;             // the mean of 16x16 values has an error of 5 %
constexpr double kFlatShare = 0.05;

double MedianMagnitude(const cv::Mat& response) {
  std::vector<double> magnitudes;
  for (int y = 0; y < response.rows; y += 3) {
    for (int x = 0; x < response.cols; x += 3) {
      magnitudes.push_back(std::abs(response.at<short>(y, x)));
    }
  }
  return Quantile(std::move(magnitudes), 0.5);
}

// Blocks without any variation, saturated or drawn by a program, do not count; 0 when all are such.
double FlatMagnitude(const cv::Mat& response) {
  std::vector<double> means;
  for (int y = 0; y + kBlock_px <= response.rows; y += kBlock_px) {
    for (int x = 0; x + kBlock_px <= response.cols; x += kBlock_px) {
      const double sum = cv::norm(response(cv::Rect(x, y, kBlock_px, kBlock_px)), cv::NORM_L1);
      if (sum > 0) means.push_back(sum / (kBlock_px * kBlock_px));
    }
  }
  return means.empty() ? 0 : Quantile(std::move(means), kFlatShare);
}

}  // namespace

ImageNoise MeasureNoise(const cv::Mat& grey) {
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::Mat response;
  cv::filter2D(grey, response, CV_16S, kernel);
  return {std::max(MedianMagnitude(response) / (kMedianOfNormal * kGain), kRounding),
          std::max(FlatMagnitude(response) / (kMeanOfNormal * kGain), kRounding)};
}

}  // namespace mono3d
