// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "synthetic/sensor_options.h"

namespace mono3d::synthetic {

// From linear light to the image: exposure (with auto exposure, drift and jumps), vignetting,
// noise, clipping, denoising, tone curve, in this order. `radiance` is CV_32FC3 (blue, green, red);
// the answer CV_8UC3. Drift and jumps follow the time `t_s`; each `frame` has noise of its own. The
// same bytes on any number of threads.
cv::Mat Develop(const cv::Mat& radiance, const SensorOptions& options, double t_s, int frame);

}  // namespace mono3d::synthetic
