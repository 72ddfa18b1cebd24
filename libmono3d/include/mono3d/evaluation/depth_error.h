// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// The error of one depth map, over the pixels that have a true depth z* and an estimate z, the
// latter multiplied by `scale`. With num_pixels = 0 there is no error to state: all measures are 0.
struct DepthError {
  std::int64_t num_true_pixels = 0;  // with a true depth (within the bound)
  std::int64_t num_pixels = 0;       // of them: with an estimate
  double density = 0;                // num_pixels / num_true_pixels, 0 to 1
  double scale = 1;                  // that the estimate was multiplied by
  double mean_true_depth = 0;        // of the pixels with a true depth (within the bound)
  double rmse = 0;                   // root of the mean of (z - z*)^2, truth's unit
  double l1_abs = 0;                 // mean of |z - z*|, truth's unit
  double l1_rel = 0;                 // mean of |z - z*| / z*
  double delta_125 = 0;              // share of the pixels with max(z / z*, z* / z) < 1.25, 0 to 1
  double delta_110 = 0;              // < 1.10
  double delta_105 = 0;              // < 1.05
  double delta_101 = 0;              // < 1.01
};

// All maps are CV_32FC1 of one size; what is not positive and finite is no depth. `max_depth`
// leaves out pixels whose true depth is larger, in the truth's unit (the paper: 300 m); 0: none.
// All functions throw Error when type or size differ.

// Median scaling of one map: the median of true depth over estimated depth, of the pixels that have
// both. (Not the ratio of the two medians: where half of an image is near and half far, few pixels
// move a median from one to the other.) Nothing when there are none.
std::optional<double> MedianDepthScale(const cv::Mat& estimate, const cv::Mat& truth,
                                       double max_depth = 0);

// One scale for a run: the median of the scales of its maps. Throws Error without any.
double RunDepthScale(std::span<const double> map_scales);

DepthError CompareDepth(const cv::Mat& estimate, const cv::Mat& truth, double scale = 1,
                        double max_depth = 0);

// The figures of many maps.
struct MeanDepthError {
  std::int64_t num_maps = 0;           // in all
  std::int64_t num_maps_compared = 0;  // with at least one pixel that has both
  // Each measure is the mean over the maps that were compared, as in the paper; `density` and
  // mean_true_depth are the means over all maps that have a true depth. The counts are sums.
  DepthError mean;
};
MeanDepthError ComputeMeanDepthError(std::span<const DepthError> errors);

// Relative error |scale * z - z*| / z* at each pixel, CV_32FC1; NaN where either depth is missing
// or the true one is beyond the bound. For pictures and for the calibration of the confidence.
cv::Mat RelativeDepthErrorImage(const cv::Mat& estimate, const cv::Mat& truth, double scale = 1,
                                double max_depth = 0);

}  // namespace mono3d
