// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/options.h"

namespace mono3d::synthetic {

// What a real camera does to a picture. Every imperfection is off by default.
struct SensorOptions {
  // The shutter.
  double readout_s = 0;   // rolling shutter: from the first row to the last; 0: all at once
  double exposure_s = 0;  // that the shutter of a row is open: motion blur; 0: a moment
  // The light.
  double exposure = 1;              // brightness factor
  double auto_exposure = 0;         // share of the way to a mean level of 0.18, 0 to 1
  double exposure_drift_stops = 0;  // standard deviation of a slow seeded drift; 1 stop: a factor 2
  double vignetting = 0;            // share of the light that is lost in the corners, below 1
  // The noise, in linear light; 1 is the level at which a pixel is full.
  double shot_noise = 0;  // standard deviation at full level; falls with the root of the level
  double read_noise = 0;  // standard deviation at every level
  int seed = 1;           // of drift and noise

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// From linear light to the image: auto exposure, drift, vignetting, noise, gamma 2.2, in this
// order. `radiance` is CV_32FC3 (blue, green, red); the answer CV_8UC3. The drift follows the time
// `t_s`; each `frame` has noise of its own. The same bytes on any number of threads.
cv::Mat Develop(const cv::Mat& radiance, const SensorOptions& options, double t_s, int frame);

// The factor that drift puts on the light at a time.
double ExposureDrift(const SensorOptions& options, double t_s);

}  // namespace mono3d::synthetic
