// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/map_joins.h"

#include <cstddef>

namespace mono3d {
namespace {

template <typename T>
void AppendList(const std::vector<T>& more, std::size_t num_points, std::vector<T>& list) {
  const bool both_have = (list.size() == num_points) && !more.empty();
  if (both_have) {
    list.insert(list.end(), more.begin(), more.end());
  } else {
    list.clear();
  }
}

}  // namespace

void MoveEntries(const MapJoin& join, std::vector<TrajectoryEntry>& entries) {
  for (TrajectoryEntry& entry : entries) {
    if (entry.map_id != join.from) continue;
    entry.map_id = join.into;
    entry.T_world_cam = join.S_into_from * entry.T_world_cam;
  }
}

PointCloud Moved(const Similarity& S_into_from, PointCloud cloud) {
  const Eigen::Quaternionf rotation = S_into_from.pose().rotation().cast<float>();
  for (Eigen::Vector3f& point : cloud.points) {
    point = (S_into_from * point.cast<double>()).cast<float>();
  }
  for (Eigen::Vector3f& normal : cloud.normals) normal = rotation * normal;
  for (float& radius : cloud.radii) radius *= static_cast<float>(S_into_from.scale());
  return cloud;
}

void AppendCloud(const PointCloud& more, PointCloud& cloud) {
  if (more.empty()) return;
  if (cloud.empty()) {
    cloud = more;
    return;
  }
  const std::size_t num_points = cloud.size();
  AppendList(more.normals, num_points, cloud.normals);
  AppendList(more.colours, num_points, cloud.colours);
  AppendList(more.radii, num_points, cloud.radii);
  AppendList(more.confidences, num_points, cloud.confidences);
  AppendList(more.observations, num_points, cloud.observations);
  AppendList(more.first_frames, num_points, cloud.first_frames);
  if (!cloud.inferred.empty() || !more.inferred.empty()) {  // nothing is inferred where it is empty
    cloud.inferred.resize(num_points, 0);
    cloud.inferred.insert(cloud.inferred.end(), more.inferred.begin(), more.inferred.end());
    cloud.inferred.resize(num_points + more.size(), 0);
  }
  cloud.points.insert(cloud.points.end(), more.points.begin(), more.points.end());
}

}  // namespace mono3d
