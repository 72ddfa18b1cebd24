// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d {

// Cells of 4x4 pixels, into which an image is divided where single pixels say too little; the last
// ones of a row or column may be cut.
inline constexpr int kImageCell_px = 4;

// The means of the cells, of the type of `image`.
cv::Mat MeansOfCells(const cv::Mat& image);

}  // namespace mono3d
