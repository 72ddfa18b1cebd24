// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/depth_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "evaluation/depth_pixels.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

void RequireScale(double scale) {
  if (scale > 0 && std::isfinite(scale)) return;
  throw Error(ErrorParts{.what = "bad scale of a depth map",
                         .where = {},
                         .expected = "a positive number",
                         .found = std::to_string(scale)});
}

// The measures of a mean that are divided by the number of compared maps.
constexpr double DepthError::*kMeasures[] = {
    &DepthError::scale,     &DepthError::rmse,      &DepthError::l1_abs,    &DepthError::l1_rel,
    &DepthError::delta_125, &DepthError::delta_110, &DepthError::delta_105, &DepthError::delta_101};

// Sums of the measures, pixel by pixel.
void AddPixel(double z, double z_true, DepthError& sums) {
  const double difference = std::abs(z - z_true);
  const double ratio = std::max(z / z_true, z_true / z);
  ++sums.num_pixels;
  sums.rmse += difference * difference;
  sums.l1_abs += difference;
  sums.l1_rel += difference / z_true;
  sums.delta_125 += ratio < 1.25 ? 1 : 0;
  sums.delta_110 += ratio < 1.10 ? 1 : 0;
  sums.delta_105 += ratio < 1.05 ? 1 : 0;
  sums.delta_101 += ratio < 1.01 ? 1 : 0;
}

}  // namespace

std::optional<double> MedianDepthScale(const cv::Mat& estimate, const cv::Mat& truth,
                                       double max_depth) {
  RequireDepthPair(estimate, truth);
  std::vector<double> ratios;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float z = estimate.at<float>(y, x);
      const float z_true = truth.at<float>(y, x);
      if (!IsDepth(z) || !IsTrueDepth(z_true, max_depth)) continue;
      ratios.push_back(static_cast<double>(z_true) / z);
    }
  }
  if (ratios.empty()) return std::nullopt;
  return Median(std::move(ratios));
}

double RunDepthScale(std::span<const double> map_scales) {
  if (map_scales.empty()) throw Error("no map has both an estimated and a true depth: no scale");
  for (const double scale : map_scales) RequireScale(scale);
  return Median(std::vector<double>(map_scales.begin(), map_scales.end()));
}

DepthError CompareDepth(const cv::Mat& estimate, const cv::Mat& truth, double scale,
                        double max_depth) {
  RequireDepthPair(estimate, truth);
  RequireScale(scale);
  DepthError error;
  double sum_of_true_depths = 0;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float z_true = truth.at<float>(y, x);
      if (!IsTrueDepth(z_true, max_depth)) continue;
      ++error.num_true_pixels;
      sum_of_true_depths += z_true;
      const float z = estimate.at<float>(y, x);
      if (IsDepth(z)) AddPixel(scale * z, z_true, error);
    }
  }
  if (error.num_true_pixels > 0) {
    const auto count = static_cast<double>(error.num_true_pixels);
    error.mean_true_depth = sum_of_true_depths / count;
    error.density = static_cast<double>(error.num_pixels) / count;
  }
  error.scale = scale;
  if (error.num_pixels == 0) return error;
  for (const auto measure : kMeasures) {
    if (measure != &DepthError::scale) error.*measure /= static_cast<double>(error.num_pixels);
  }
  error.rmse = std::sqrt(error.rmse);
  return error;
}

MeanDepthError ComputeMeanDepthError(std::span<const DepthError> errors) {
  MeanDepthError result;
  DepthError& mean = result.mean;
  mean.scale = 0;
  std::int64_t num_maps_with_truth = 0;
  for (const DepthError& error : errors) {
    ++result.num_maps;
    mean.num_true_pixels += error.num_true_pixels;
    mean.num_pixels += error.num_pixels;
    if (error.num_true_pixels > 0) {
      ++num_maps_with_truth;
      mean.density += error.density;
      mean.mean_true_depth += error.mean_true_depth;
    }
    if (error.num_pixels == 0) continue;
    ++result.num_maps_compared;
    for (const auto measure : kMeasures) mean.*measure += error.*measure;
  }
  if (num_maps_with_truth > 0) {
    mean.density /= static_cast<double>(num_maps_with_truth);
    mean.mean_true_depth /= static_cast<double>(num_maps_with_truth);
  }
  if (result.num_maps_compared == 0) {
    mean.scale = 1;
    return result;
  }
  for (const auto measure : kMeasures) {
    mean.*measure /= static_cast<double>(result.num_maps_compared);
  }
  return result;
}

cv::Mat RelativeDepthErrorImage(const cv::Mat& estimate, const cv::Mat& truth, double scale,
                                double max_depth) {
  RequireDepthPair(estimate, truth);
  RequireScale(scale);
  cv::Mat error(truth.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float z = estimate.at<float>(y, x);
      const float z_true = truth.at<float>(y, x);
      if (!IsDepth(z) || !IsTrueDepth(z_true, max_depth)) continue;
      error.at<float>(y, x) = static_cast<float>(std::abs(scale * z - z_true) / z_true);
    }
  }
  return error;
}

}  // namespace mono3d
