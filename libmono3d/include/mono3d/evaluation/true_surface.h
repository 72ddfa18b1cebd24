// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// What one image of a sequence truly shows.
struct TrueView {
  CameraModel camera;  // without distortion
  Pose T_world_cam;    // in the frame of the true cloud
  cv::Mat depth;       // CV_32FC1, of the camera's size, z-depth in metres; 0: none
};

// Gives the view of an index below the number of views; asked for in order, once by each function.
using TrueViewReader = std::function<TrueView(std::size_t)>;

// Median distance of a point to its nearest neighbour. Throws Error when the cloud is empty or not
// finite.
double CloudSpacing(const PointCloud& cloud);

// A true cloud may lack what its sequence shows: parts that only images saw of which it was not
// made. The points of the cloud, in their order, and behind them those that were missing: where a
// view shows a surface and no point is within two spacings, give or take the half of it, points are
// added, with as much between them. Depths at which neighbouring pixels are further apart than the
// points of the cloud show less than the cloud, and add nothing. Positions alone.
// Throws Error when the cloud is empty or not finite, a view's depth has another size or type, or
// its camera has distortion.
PointCloud CompleteTrueCloud(const PointCloud& cloud, std::size_t num_views,
                             const TrueViewReader& view);

// The depth that the cloud itself shows in a view, for sequences without true depth maps: points
// are drawn as wide as two spacings, the nearest one counts. CV_32FC1; 0 where there is none.
cv::Mat RenderTrueDepth(const PointCloud& cloud, double spacing_m, const CameraModel& camera,
                        const Pose& T_world_cam);

// How many views see each point: it falls into their image and lies no more than two spacings
// behind the farthest of the nine depths around. So much a cloud with one point in each cell of a
// grid may be off the surface between its points. Throws Error on a view as CompleteTrueCloud does.
std::vector<std::uint32_t> CountViews(const PointCloud& cloud, double spacing_m,
                                      std::size_t num_views, const TrueViewReader& view);

// Of the true points that at least `min_views` see: the share whose distance to the estimate
// (CloudError::truth_distances_m) is within the threshold. 0 when there are none. Throws Error
// unless both lists are equally long.
double CompletenessOfSeen(std::span<const double> truth_distances_m,
                          std::span<const std::uint32_t> num_views, std::uint32_t min_views,
                          double threshold_m);

}  // namespace mono3d
