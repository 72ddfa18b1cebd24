// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// Standard deviations of the noise of an image, CV_8UC1, in grey levels: of what no plane or edge
// along the axes explains (Immerkaer 1996). Rounding to whole grey levels alone leaves 0.29, the
// least that is given.
struct ImageNoise {
  double typical = 0.29;  // the median over the image: with what texture adds to it
  double flat = 0.29;  // of the flattest twentieth of the image: hardly more than the sensor's own
};

ImageNoise MeasureNoise(const cv::Mat& grey);

// The mean DoG response from which on there is texture: that of the options, for images whose noise
// is one grey level or less, and more in proportion where there is more, up to five.
double LeastResponse(const DogOptions& options, const ImageNoise& noise);

}  // namespace mono3d
