// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/posed_views.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace mono3d {
namespace {

constexpr double kRadians = std::numbers::pi / 180;

PosedKeyframe At(std::int64_t id, const Pose& T_world_cam) {
  PosedKeyframe posed;
  posed.keyframe.id = id;
  posed.keyframe.frame.camera = kViewCamera;
  posed.keyframe.frame.bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(0));
  posed.pose.keyframe_id = id;
  posed.pose.S_world_kf = Similarity(1, T_world_cam);
  return posed;
}

// What a camera sees of a surface, pixel by pixel of a grid; depth 0 where it sees none.
template <typename DepthAt>
void AddPoints(const DepthAt& depth_at, PosedKeyframe& posed) {
  for (int y = 10; y < kViewCamera.height; y += 20) {
    for (int x = 10; x < kViewCamera.width; x += 20) {
      const double depth = depth_at(kViewCamera.Unproject({x, y}));
      if (!(depth > 0)) continue;
      posed.keyframe.sparse_depths_su.push_back(static_cast<float>(depth));
      posed.keyframe.sparse_pixels.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
}

PosedKeyframe MakeBeforeWall(std::int64_t id, const Eigen::Quaterniond& rotation,
                             double baseline_ratio, double scale) {
  const double wall = scale * kMedianDepth_su;
  const Pose T_world_cam(rotation, Eigen::Vector3d(baseline_ratio * wall, 0, 0));
  PosedKeyframe posed = At(id, T_world_cam);
  AddPoints(
      [&](const Eigen::Vector3d& ray) {
        const double forward = (rotation * ray).z();
        return forward > 0.1 ? wall / forward : 0;
      },
      posed);
  return posed;
}

}  // namespace

PosedKeyframe MakeKeyframe(std::int64_t id, double baseline_ratio, double rotation_deg,
                           double scale) {
  const Eigen::Quaterniond rotation = RotationExp(Eigen::Vector3d(0, rotation_deg * kRadians, 0));
  return MakeBeforeWall(id, rotation, baseline_ratio, scale);
}

PosedKeyframe MakeRolled(std::int64_t id, double baseline_ratio, double roll_deg) {
  const Eigen::Quaterniond rotation = RotationExp(Eigen::Vector3d(0, 0, roll_deg * kRadians));
  return MakeBeforeWall(id, rotation, baseline_ratio, 1);
}

PosedKeyframe MakeAboveGround(std::int64_t id, const Pose& T_world_cam, double height_su) {
  PosedKeyframe posed = At(id, T_world_cam);
  AddPoints(
      [&](const Eigen::Vector3d& ray) {
        const double down = (T_world_cam.rotation() * ray).y();
        const double depth = (height_su - T_world_cam.translation().y()) / down;
        return down > 0 && depth < 40 * height_su ? depth : 0;
      },
      posed);
  return posed;
}

PosedKeyframe MakeOnCircle(std::int64_t id, double angle_deg) {
  const Eigen::Quaterniond rotation = RotationExp(Eigen::Vector3d(0, -angle_deg * kRadians, 0));
  const Eigen::Vector3d centre(0, 0, kMedianDepth_su);
  const Pose T_world_cam(rotation, centre - rotation * centre);
  PosedKeyframe posed = At(id, T_world_cam);
  // A ball around the centre, a quarter as large as the circle.
  const double radius = 0.25 * kMedianDepth_su;
  AddPoints(
      [&](const Eigen::Vector3d& ray) {
        const Eigen::Vector3d direction = ray.normalized();
        const double along = direction.dot(centre);
        const double inside = radius * radius - (centre.squaredNorm() - along * along);
        return inside > 0 ? (along - std::sqrt(inside)) * direction.z() : 0;
      },
      posed);
  return posed;
}

std::vector<ImageBundle> TrackedSelector::Select(const std::vector<PosedKeyframe>& keyframes) {
  std::vector<ImageBundle> bundles;
  for (const PosedKeyframe& posed : keyframes) {
    if (auto bundle = Add(posed)) bundles.push_back(*std::move(bundle));
  }
  for (ImageBundle& bundle : Finish()) bundles.push_back(std::move(bundle));
  return bundles;
}

IdList Ids(const ImageBundle& bundle) {
  IdList ids;
  for (const Keyframe& keyframe : bundle.keyframes) ids.push_back(keyframe.id);
  return ids;
}

IdList References(const std::vector<ImageBundle>& bundles) {
  IdList ids;
  for (const ImageBundle& bundle : bundles) ids.push_back(bundle.reference().id);
  return ids;
}

}  // namespace mono3d
