// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "synthetic/sensor_options.h"

namespace mono3d::synthetic {

// The noise of one frame: of photons and of reading them out. Levels are linear light, 1 is white.
// With full_well_electrons the photons are counted: their number has a Poisson distribution.
// Without it the noise is normal, with the standard deviations of the options.
class SensorNoise {
 public:
  SensorNoise(const SensorOptions& options, int frame);

  bool IsNone() const { return read_variance_ + shot_variance_ <= 0; }
  // Where the light of a pixel is cut off before the noise: white, or the full well.
  float max_level() const { return max_level_; }
  // Of a level without noise.
  float Sigma(float level) const;

  // `level`, 0 to max_level(), with the noise of this pixel; it may leave that range.
  float Add(float level, cv::Point pixel, int channel) const;

 private:
  float Count(float level, cv::Point pixel, int channel) const;

  std::uint32_t seed_;
  float max_level_ = 1;
  float electrons_at_white_ = 0;  // 0: normal noise
  float shot_variance_ = 0;       // at white
  float read_variance_ = 0;
};

// What in-camera processing makes of noise: each value goes by `share` of the way to the mean of
// those of the 5 x 5 pixels about it that differ by less than two standard deviations of the noise
// (the sigma filter, Lee 1983), mirrored at the border. `levels` is CV_32FC3.
cv::Mat SmoothNoise(const cv::Mat& levels, const SensorNoise& noise, double share);

}  // namespace mono3d::synthetic
