// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "drawing/cloud_view.h"
#include "mono3d/geometry/point_cloud.h"

namespace mono3d::tools {

// One row per view: the estimate on the left, the truth on the right, each in its own colours, with
// titles. Both must be in one frame. CV_8UC3.
cv::Mat CloudsSideBySide(const PointCloud& estimate_in_truth, const PointCloud& truth,
                         std::span<const CloudView> views);

// The two in one picture, one row per view, in the paper's colours: estimate yellow, truth
// blue; the nearer surface hides the other. CV_8UC3.
cv::Mat CloudsInTwoColours(const PointCloud& estimate_in_truth, const PointCloud& truth,
                           std::span<const CloudView> views);

// The estimate coloured by the distance of each point, from 0 to `max_distance_m`, one row per
// view, with a colour bar whose numbers are metres and, with `mean_depth_m`, percent of the depth.
// CV_8UC3.
cv::Mat CloudByDistance(const PointCloud& estimate_in_truth, std::span<const double> distances_m,
                        double max_distance_m, std::span<const CloudView> views,
                        std::optional<double> mean_depth_m = {});

}  // namespace mono3d::tools
