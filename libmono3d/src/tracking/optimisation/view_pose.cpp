// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/view_pose.h"

#include <cstddef>
#include <vector>

#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {

PoseResult RefinePose(const Map& map, View& view) {
  std::vector<PointMeasurement> measurements;
  std::vector<std::size_t> features;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    const Feature& feature = view.features[i];
    const Eigen::Vector3d& p_world = map.point(*view.points[i]).p_world;
    measurements.push_back(
        {p_world, map.AtMiddleLine(view, feature.pixel, p_world), feature.sigma_px});
    features.push_back(i);
  }
  if (measurements.size() < 4) {
    view.points.assign(view.features.size(), std::nullopt);
    return {};
  }
  const PoseEstimate estimate = OptimisePose(map.camera(), view.T_cam_world, measurements);
  view.T_cam_world = estimate.T_cam_world;
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (estimate.is_inlier[k] == 0) view.points[features[k]].reset();
  }
  return {estimate.num_inliers, estimate.reprojection_px};
}

}  // namespace mono3d::tracking
