// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d {

// What is known of cells (image_cells.h) before depth is inferred in them, CV_32FC4: inverse depth
// of a plane in the middle of the cell (1/su), its slopes along x and y (1/su per px), and the
// confidence in it; that is 0 where no plane is known, and below 0 in the sky.
//
// Planes are fitted to regions without depth of one colour, such as a roof, a wall or a door: where
// most of what was matched around a region and in it lies on one plane, so does the region. The
// confidence falls with the standard deviation of the plane there, in planes of the sweep. A region
// in which most of what the texture filter took away lies on a smooth surface needs none: that says
// more of its shape. `bgr` is CV_8UC3, `depth` CV_32FC1 in su, 0 where nothing was matched;
// `unfiltered` CV_32FC1, inverse depth before the texture filter, 1/su; `sky` as FindSky has it;
// `step` is that between planes of the sweep, 1/su.
cv::Mat FindPlanarRegions(const cv::Mat& bgr, const cv::Mat& depth, const cv::Mat& unfiltered,
                          const cv::Mat& sky, double step);

}  // namespace mono3d
