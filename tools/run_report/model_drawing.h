// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "drawing/cloud_view.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

// At most `max_size` of the points, taken at equal distances in their order; radii are enlarged as
// the points become fewer, so that they still close the surface.
PointCloud SampleOf(const PointCloud& cloud, std::size_t max_size);

// What there is of the map to draw: a sample of the model, or else of the tracker's points.
PointCloud PointsToDraw(const MapReconstruction& map, std::size_t max_size);

// Quick pictures for the report of a run: squares as large as the radii, the nearest is seen, no
// shading. All are CV_8UC3 on white and take milliseconds.

// From above and from two sides, with the path of the camera, its keyframes, and where it began.
// Without a map it says so. Photographs in any order have places but no path.
cv::Mat OverviewPicture(const Reconstruction& reconstruction, bool is_path);

// From above: how many depth maps saw each place. Empty without a model.
cv::Mat CoveragePicture(const MapReconstruction& map);

// From above: an arrow from each of the next views to what it looks at, with its number from 1 on.
// Empty without any.
cv::Mat NextViewsPicture(const MapReconstruction& map, const NextViews& next);

// Where up is, as far as the axes of the map tell.
std::optional<Eigen::Vector3d> KnownUp(const MapReconstruction& map);

// The views of OverviewPicture, from above first: they show the path as well. Empty without points
// and path.
std::vector<CloudView> ViewsOf(const PointCloud& cloud, const MapReconstruction& map, int width_px);

}  // namespace mono3d::tools
