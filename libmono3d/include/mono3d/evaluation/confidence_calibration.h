// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Does the confidence know which depths are wrong? Sparsification (Ilg et al. 2018): pixels are
// dropped from the least confident on, and the mean error of those left is watched. Dropping by the
// true error instead gives the best curve that any confidence could reach, the oracle.
// Without any pixel, and without any error, all figures are 0.
struct ConfidenceCalibration {
  std::int64_t num_pixels = 0;
  double mean_error = 0;  // of all pixels: L1-rel
  // Curves of kNumSteps values: the mean error left when the share i / kNumSteps of the pixels is
  // dropped.
  static constexpr int kNumSteps = 100;
  std::vector<double> error_left;
  std::vector<double> error_left_oracle;
  // Area between the two curves, each divided by mean_error (AUSE): 0 for the oracle.
  double area_to_oracle = 0;
  // The same for dropping at random, whose curve is level: a confidence with a larger area does
  // harm.
  double random_area_to_oracle = 0;
  // 1 - error left / mean error when the worst tenth is dropped; may be negative.
  double error_removed_by_worst_tenth = 0;
  double error_removed_by_worst_tenth_oracle = 0;
};

// `relative_error` as RelativeDepthErrorImage gives it (NaN: left out) and `confidence`, both
// CV_32FC1 of one size. Pixels of equal confidence are dropped together, each in part. Throws Error
// when type or size differ or a confidence is not finite.
ConfidenceCalibration CalibrateConfidence(const cv::Mat& relative_error, const cv::Mat& confidence);

// The mean of each figure and curve over the maps that have pixels; num_pixels is the sum.
ConfidenceCalibration MeanCalibration(std::span<const ConfidenceCalibration> maps);

}  // namespace mono3d
