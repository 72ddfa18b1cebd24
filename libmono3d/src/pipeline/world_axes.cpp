// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/world_axes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace mono3d {
namespace {

// The rotation into axes with z along `up` and y along what of `forward` is level.
Eigen::Matrix3d LevelRotation(const Eigen::Vector3d& up, const Pose& T_world_cam,
                              const ImageDirections& shown) {
  // Of a camera that looks down, that is where the top of its image is.
  Eigen::Vector3d right = T_world_cam.rotation() * shown.right;
  right -= right.dot(up) * up;
  const Eigen::Vector3d x = right.norm() > 0.1 ? Eigen::Vector3d(right.normalized())
                                               : Eigen::Vector3d(up.unitOrthogonal());
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), up.cross(x).transpose(), up.transpose();
  return rotation;
}

double Quantile(std::vector<double> values, double share) {
  const auto position = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + position, values.end());
  return values[static_cast<std::size_t>(position)];
}

// One axis at a time: a model may take most of the memory that there is.
double CoordinateOf(const MapReconstruction& map, const Eigen::Matrix3d& rotation,
                    Eigen::Index axis, double share) {
  std::vector<double> values;
  values.reserve(map.model.size());
  const auto add = [&](const Eigen::Vector3d& p_world) {
    values.push_back((rotation * p_world).eval()[axis]);
  };
  for (const Eigen::Vector3f& point : map.model.points) add(point.cast<double>());
  if (map.model.empty()) {
    for (const SparsePoint& point : map.sparse.points) add(point.p_world);
  }
  if (values.empty()) {
    for (const TrajectoryEntry& keyframe : map.keyframes) add(keyframe.T_world_cam.translation());
  }
  return Quantile(std::move(values), share);
}

// In the middle of what is seen, at the height of its lower parts, in axes with z up.
Eigen::Vector3d OriginOf(const MapReconstruction& map, const Eigen::Matrix3d& rotation) {
  constexpr double kGroundShare = 0.1;
  return {CoordinateOf(map, rotation, 0, 0.5), CoordinateOf(map, rotation, 1, 0.5),
          CoordinateOf(map, rotation, 2, kGroundShare)};
}

void MoveCloud(const Similarity& S, PointCloud& cloud) {
  for (Eigen::Vector3f& point : cloud.points) point = (S * point.cast<double>()).cast<float>();
  const Eigen::Quaternionf rotation = S.pose().rotation().cast<float>();
  for (Eigen::Vector3f& normal : cloud.normals) normal = rotation * normal;
  for (float& radius : cloud.radii) radius *= static_cast<float>(S.scale());
}

void MoveSparse(const Similarity& S, SparseModel& sparse) {
  for (SparseImage& image : sparse.images) {
    image.T_world_cam = S * image.T_world_cam;
    if (image.velocity) image.velocity->Rescale(S.scale());
  }
  for (SparsePoint& point : sparse.points) point.p_world = S * point.p_world;
}

}  // namespace

WorldAxes ChooseWorldAxes(const MapReconstruction& map, int turn_deg) {
  std::vector<Pose> T_world_cam;
  for (const TrajectoryEntry& keyframe : map.keyframes) T_world_cam.push_back(keyframe.T_world_cam);
  const std::optional<Eigen::Vector3d> up = FindUp(T_world_cam, map.model.normals, turn_deg);
  if (!up) return {};
  const Eigen::Matrix3d rotation =
      LevelRotation(*up, T_world_cam.front(), ImageDirections::Shown(turn_deg));
  return {Similarity(1, Pose(rotation, -OriginOf(map, rotation))), AxesSource::kLevel};
}

bool IsLevel(const WorldAxes& axes) {
  return axes.source == AxesSource::kLevel || axes.source == AxesSource::kEarth ||
         (axes.source == AxesSource::kSavedMap && axes.S_axes_world.pose().RotationAngle() > 1e-9);
}

void MoveWorld(const Similarity& S_new_old, MapReconstruction& map) {
  for (auto* entries :
       {&map.trajectory, &map.online_trajectory, &map.keyframes, &map.model_trajectory}) {
    for (TrajectoryEntry& entry : *entries) entry.T_world_cam = S_new_old * entry.T_world_cam;
  }
  MoveCloud(S_new_old, map.model);
  MoveSparse(S_new_old, map.sparse);
}

void MoveInto(const WorldAxes& axes, MapReconstruction& map) {
  MoveWorld(axes.S_axes_world, map);
  map.axes = axes;
}

}  // namespace mono3d
