// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/depth_uncertainty.h"

#include <cmath>
#include <optional>

namespace mono3d::tracking {

Eigen::Vector3d MeanCentre(const Map& map, const MapPoint& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Observation& seen : point.observations)
    sum += map.keyframe(seen.keyframe).view.Centre();
  return sum / static_cast<double>(point.observations.size());
}

Eigen::Vector3d DepthAxis(const Map& map, const MapPoint& point) {
  if (point.depth_sigma == 0 || point.observations.empty()) return Eigen::Vector3d::Zero();
  return point.depth_sigma * (point.p_world - MeanCentre(map, point));
}

double DepthSigma(const Map& map, const MapPoint& point) {
  const Eigen::Vector3d mean = MeanCentre(map, point);
  const Eigen::Vector3d line = point.p_world - mean;
  const double distance = line.norm();
  double information = 1 / (kGuessedDepthSigma * kGuessedDepthSigma);
  for (const Observation& seen : point.observations) {
    const View& view = map.keyframe(seen.keyframe).view;
    const double sideways = (view.Centre() - mean).cross(line).norm() / distance;
    const double moved_px = map.camera().fx * sideways / distance;  // by the whole inverse depth
    const double sigma_px = view.features[seen.feature].sigma_px;
    information += moved_px * moved_px / (sigma_px * sigma_px);
  }
  return 1 / std::sqrt(information);
}

void UpdateDepthSigmas(Map& map, KeyframeId keyframe) {
  for (const std::optional<PointId>& id : map.keyframe(keyframe).view.points) {
    if (!id || map.point(*id).depth_sigma == 0) continue;
    MapPoint& point = map.point(*id);
    const double sigma = DepthSigma(map, point);
    point.depth_sigma = sigma < kKnownDepthSigma ? 0 : sigma;
  }
}

double ShareOfDirections(const Map& map, const View& view) {
  int num_points = 0;
  int num_directions = 0;
  for (const std::optional<PointId>& point : view.points) {
    if (!point || !map.IsAlive(*point)) continue;
    ++num_points;
    num_directions += map.point(*point).depth_sigma > 0 ? 1 : 0;
  }
  return num_points > 0 ? static_cast<double>(num_directions) / num_points : 0;
}

}  // namespace mono3d::tracking
