// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/confidence_calibration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>

#include "evaluation/depth_pixels.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

struct Pixel {
  float rank = 0;  // dropped in falling order
  float error = 0;
};

std::vector<Pixel> CollectPixels(const cv::Mat& relative_error, const cv::Mat& confidence) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < relative_error.rows; ++y) {
    for (int x = 0; x < relative_error.cols; ++x) {
      const float error = relative_error.at<float>(y, x);
      if (std::isnan(error)) continue;
      const float value = confidence.at<float>(y, x);
      if (!std::isfinite(value)) throw Error("a confidence is not finite");
      pixels.push_back({-value, error});
    }
  }
  return pixels;
}

// The mean error of what is left at each step. A share of the pixels that ends inside a pixel, or
// among pixels of equal rank, drops a part of their mean error.
std::vector<double> SparsificationCurve(std::vector<Pixel> pixels) {
  // The error as second key: sums in one order, whatever the order of the pixels.
  std::sort(pixels.begin(), pixels.end(), [](const Pixel& a, const Pixel& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.error < b.error;
  });
  // Kept pixels stand first: step i keeps the first (1 - i / kNumSteps) of them.
  constexpr int kNumSteps = ConfidenceCalibration::kNumSteps;
  const auto count = static_cast<double>(pixels.size());
  std::vector<double> curve(kNumSteps, 0);
  double sum = 0;  // of the errors of the groups before `begin`
  std::size_t begin = 0;
  int step = kNumSteps - 1;
  while (begin < pixels.size()) {
    std::size_t end = begin;
    double group_sum = 0;
    for (; end < pixels.size() && pixels[end].rank == pixels[begin].rank; ++end) {
      group_sum += pixels[end].error;
    }
    const auto num_before = static_cast<double>(begin);
    const auto group_size = static_cast<double>(end - begin);
    for (; step >= 0; --step) {
      const double kept = count * (kNumSteps - step) / kNumSteps;
      // The last group holds all that is left, whatever rounding says.
      if (kept > num_before + group_size && end < pixels.size()) break;
      const double part = std::min((kept - num_before) / group_size, 1.0);
      curve[static_cast<std::size_t>(step)] = (sum + part * group_sum) / kept;
    }
    sum += group_sum;
    begin = end;
  }
  return curve;
}

// By the trapezoid rule; at the end, where nothing is left, the curves count as level.
double AreaBetween(const std::vector<double>& upper, const std::vector<double>& lower) {
  double area = 0;
  for (std::size_t i = 0; i < upper.size(); ++i) {
    const std::size_t next = std::min(i + 1, upper.size() - 1);
    area += (upper[i] - lower[i] + upper[next] - lower[next]) / 2;
  }
  return area / static_cast<double>(upper.size());
}

constexpr double ConfidenceCalibration::*kFigures[] = {
    &ConfidenceCalibration::mean_error, &ConfidenceCalibration::area_to_oracle,
    &ConfidenceCalibration::random_area_to_oracle,
    &ConfidenceCalibration::error_removed_by_worst_tenth,
    &ConfidenceCalibration::error_removed_by_worst_tenth_oracle};

}  // namespace

ConfidenceCalibration CalibrateConfidence(const cv::Mat& relative_error,
                                          const cv::Mat& confidence) {
  RequireImage(relative_error, "the relative error", CV_32FC1, relative_error.size());
  RequireImage(confidence, "the confidence", CV_32FC1, relative_error.size());
  ConfidenceCalibration calibration;
  std::vector<Pixel> pixels = CollectPixels(relative_error, confidence);
  if (pixels.empty()) return calibration;
  calibration.num_pixels = static_cast<std::int64_t>(pixels.size());
  calibration.error_left = SparsificationCurve(pixels);
  for (Pixel& pixel : pixels) pixel.rank = pixel.error;
  calibration.error_left_oracle = SparsificationCurve(std::move(pixels));
  const double mean = calibration.error_left.front();
  calibration.mean_error = mean;
  if (!(mean > 0)) return calibration;
  const std::vector<double> level(ConfidenceCalibration::kNumSteps, mean);
  const std::vector<double>& oracle = calibration.error_left_oracle;
  calibration.area_to_oracle = AreaBetween(calibration.error_left, oracle) / mean;
  calibration.random_area_to_oracle = AreaBetween(level, oracle) / mean;
  constexpr std::size_t kTenth = ConfidenceCalibration::kNumSteps / 10;
  calibration.error_removed_by_worst_tenth = 1 - calibration.error_left[kTenth] / mean;
  calibration.error_removed_by_worst_tenth_oracle = 1 - oracle[kTenth] / mean;
  return calibration;
}

ConfidenceCalibration MeanCalibration(std::span<const ConfidenceCalibration> maps) {
  constexpr std::size_t kNumSteps = ConfidenceCalibration::kNumSteps;
  ConfidenceCalibration mean;
  double count = 0;
  for (const ConfidenceCalibration& map : maps) {
    if (map.num_pixels == 0) continue;
    ++count;
    mean.num_pixels += map.num_pixels;
    for (const auto figure : kFigures) mean.*figure += map.*figure;
    for (auto curve :
         {&ConfidenceCalibration::error_left, &ConfidenceCalibration::error_left_oracle}) {
      (mean.*curve).resize(kNumSteps, 0);
      std::transform((map.*curve).begin(), (map.*curve).end(), (mean.*curve).begin(),
                     (mean.*curve).begin(), std::plus<>());
    }
  }
  if (count == 0) return mean;
  for (const auto figure : kFigures) mean.*figure /= count;
  for (double& value : mean.error_left) value /= count;
  for (double& value : mean.error_left_oracle) value /= count;
  return mean;
}

}  // namespace mono3d
