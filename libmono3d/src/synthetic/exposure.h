// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "synthetic/sensor_options.h"

namespace mono3d::synthetic {

// The factor that drift puts on the light at a time.
double ExposureDrift(const SensorOptions& options, double t_s);

// The factor of the steps of the exposure at a time: 1, or one step above or below. A step takes no
// time. The times between steps are half to one and a half of exposure_step_interval_s.
double ExposureStep(const SensorOptions& options, double t_s);

// The factor by which the sensor multiplies the light of a frame: exposure, auto exposure, drift
// and steps together. `radiance` is CV_32FC3.
double ExposureFactor(const cv::Mat& radiance, const SensorOptions& options, double t_s);

}  // namespace mono3d::synthetic
