// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/view_pose.h"

#include <cstddef>
#include <vector>

#include "tracking/map/depth_uncertainty.h"
#include "tracking/optimisation/pose_and_velocity.h"
#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {

namespace {

struct ViewMeasurements {
  std::vector<PointMeasurement> measurements;
  std::vector<std::size_t> features;  // of each
};

ViewMeasurements MeasurementsOf(const Map& map, const View& view) {
  ViewMeasurements all;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i] || !map.IsAlive(*view.points[i])) continue;
    const Feature& feature = view.features[i];
    const MapPoint& point = map.point(*view.points[i]);
    all.measurements.push_back(
        {point.p_world, feature.pixel, feature.sigma_px, DepthAxis(map, point)});
    all.features.push_back(i);
  }
  return all;
}

}  // namespace

PoseResult RefinePose(const Map& map, View& view) {
  const ViewMeasurements all = MeasurementsOf(map, view);
  if (all.measurements.size() < 4) {
    view.points.assign(view.features.size(), std::nullopt);
    return {};
  }
  PoseEstimate estimate;
  const CameraModel& sensor = view.frame.sensor;
  if (sensor.shutter.IsGlobal()) {
    estimate = OptimisePose(map.camera(), view.T_cam_world, all.measurements);
  } else {
    const PoseAndVelocity found = OptimisePoseAndVelocity(map.camera(), sensor, view.T_cam_world,
                                                          view.velocity_prior, all.measurements);
    estimate = found.pose;
    view.shutter = {sensor, found.velocity};
  }
  view.T_cam_world = estimate.T_cam_world;
  for (std::size_t k = 0; k < all.features.size(); ++k) {
    if (estimate.is_inlier[k] == 0) view.points[all.features[k]].reset();
  }
  return {estimate.num_inliers, estimate.reprojection_px, estimate.noise_scale};
}

}  // namespace mono3d::tracking
