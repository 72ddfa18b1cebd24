// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/anchor.h"

#include <algorithm>

namespace mono3d {

std::optional<Similarity> TrackedPose(const KeyframePoses& poses, int map_id, Anchor& anchor) {
  const KeyframePose* found = poses.Find(anchor.keyframe_id);
  if (found == nullptr || found->map_id != map_id) return std::nullopt;
  const Similarity& S_world_kf = found->S_world_kf;
  return Similarity(anchor.depth_scale.Update(poses, *found) * S_world_kf.scale(),
                    S_world_kf.pose());
}

Eigen::Vector3d Centre(const PlacedAnchor& view) {
  return view.S_world_kf * Eigen::Vector3d(0, 0, view.anchor.median_depth_su);
}

std::array<Eigen::Vector3d, 9> Places(const PlacedAnchor& view) {
  const CameraModel& camera = view.anchor.camera;
  std::array<Eigen::Vector3d, 9> places;
  std::size_t i = 0;
  for (const double row : {0.1, 0.5, 0.9}) {
    for (const double column : {0.1, 0.5, 0.9}) {
      const Eigen::Vector2d pixel(column * camera.width, row * camera.height);
      places.at(i++) =
          view.S_world_kf * Eigen::Vector3d(view.anchor.median_depth_su * camera.Unproject(pixel));
    }
  }
  return places;
}

bool Sees(const PlacedAnchor& view, const Eigen::Vector3d& point_world) {
  const CameraModel& camera = view.anchor.camera;
  const Eigen::Vector3d p = view.S_world_kf.Inverse() * point_world;
  if (p.z() <= 0) return false;
  const double u = camera.fx * p.x() / p.z() + camera.cx;
  const double v = camera.fy * p.y() / p.z() + camera.cy;
  return u >= 0 && v >= 0 && u < camera.width && v < camera.height;
}

double MotionOverDepth(const PlacedAnchor& view, const Similarity& motion) {
  const auto places = Places(view);
  double farthest = 0;
  for (const Eigen::Vector3d& p : places) farthest = std::max(farthest, (motion * p - p).norm());
  return farthest / view.median_depth();
}

}  // namespace mono3d
