// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "view/view_store.h"

namespace mono3d::tools {

// A copy of its own, at most so wide.
cv::Mat SmallPicture(const cv::Mat& image, int width_px, int interpolation);

// Of an 8-bit image; null of an empty one.
SharedBytes ToJpeg(const cv::Mat& image);

}  // namespace mono3d::tools
