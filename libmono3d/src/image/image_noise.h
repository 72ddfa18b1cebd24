// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d {

// Standard deviations of the noise of an image in grey levels, from a kernel that is zero on planes
// and on edges along the axes (Immerkaer 1996). At least 0.29, the noise of rounding to whole grey
// levels.
struct ImageNoise {
  double typical = 0.29;  // median over the image; includes fine texture
  double flat = 0.29;     // of the flattest twentieth of the image: close to the sensor's own noise
};

// `grey` is CV_8UC1.
ImageNoise MeasureNoise(const cv::Mat& grey);

}  // namespace mono3d
