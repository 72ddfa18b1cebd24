// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d {

// Cells of 4x4 pixels of an upright image, CV_8UC1, 255 where they are taken for sky: smooth and
// bright, not redder than blue, and connected with the upper border of the image over cells like
// that, unless matching found depth inside, or on both sides as of one surface. A white ceiling
// without any texture is taken for sky as well: what is to be said of it without depth is the same.
// `bgr` is CV_8UC3, `depth` CV_32FC1, 0 where nothing was matched.
cv::Mat FindSky(const cv::Mat& bgr, const cv::Mat& depth);

}  // namespace mono3d
