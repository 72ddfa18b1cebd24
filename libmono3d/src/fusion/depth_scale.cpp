// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/depth_scale.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <utility>

#include "fusion/state_archive.h"

namespace mono3d {
namespace {

// Of the camera of another keyframe in that of the reference, in its own unit.
std::optional<Pose> FindRelativePose(const KeyframePoses& poses, const KeyframePose& reference,
                                     std::int64_t keyframe_id) {
  const KeyframePose* found = poses.Find(keyframe_id);
  if (found == nullptr || found->map_id != reference.map_id) return std::nullopt;
  return RelativePose(reference.S_world_kf, found->T_world_cam());
}

bool AreSamePose(const std::optional<Pose>& a, const std::optional<Pose>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->translation() == b->translation() && a->rotation().coeffs() == b->rotation().coeffs();
}

// The derivative of where a camera sees a point, by a motion of the point.
Eigen::Vector2d MotionInImage(const Eigen::Vector3d& p_cam, const Eigen::Vector3d& motion) {
  return (motion.head<2>() - p_cam.hnormalized() * motion.z()) / p_cam.z();
}

}  // namespace

DepthScale::DepthScale(const DepthMap& map, double median_depth_su) {
  for (const MatchedView& view : map.views) {
    views_.push_back({view.keyframe_id, view.T_ref_cam.Inverse(), view.T_ref_cam});
  }
  // In nine parts of the image: a plane at the median depth stands for the surface.
  for (const double row : {0.1, 0.5, 0.9}) {
    for (const double column : {0.1, 0.5, 0.9}) {
      const Eigen::Vector2d pixel(column * map.camera.width, row * map.camera.height);
      places_.emplace_back(median_depth_su * map.camera.Unproject(pixel));
    }
  }
}

double DepthScale::Update(const KeyframePoses& poses, const KeyframePose& reference) {
  bool has_changed = false;
  for (View& view : views_) {
    auto T_ref_cam = FindRelativePose(poses, reference, view.keyframe_id);
    has_changed = has_changed || !AreSamePose(T_ref_cam, view.T_ref_cam);
    view.T_ref_cam = std::move(T_ref_cam);
  }
  if (has_changed) Fit();
  return value_;
}

// Gauss-Newton: the views see the places, at `value_` times their depths, where they saw them when
// the depth map was made, by least squares of the image.
void DepthScale::Fit() {
  constexpr int kMaxSteps = 10;
  constexpr double kSmallStep = 1e-9;
  double value = value_;
  for (int i = 0; i < kMaxSteps; ++i) {
    double normal = 0, right = 0;
    for (const View& view : views_) {
      if (!view.T_ref_cam) continue;
      const Pose T_cam_ref = view.T_ref_cam->Inverse();
      for (const Eigen::Vector3d& place : places_) {
        const Eigen::Vector3d then = view.T_cam_ref_then * place;
        const Eigen::Vector3d now = T_cam_ref * Eigen::Vector3d(value * place);
        if (then.z() <= 0 || now.z() <= 0) continue;
        const Eigen::Vector2d slope = MotionInImage(now, T_cam_ref.rotation() * place);
        normal += slope.squaredNorm();
        right += slope.dot(then.hnormalized() - now.hnormalized());
      }
    }
    if (!(normal > 0)) return;  // no view left, or none that has moved
    const double step = right / normal;
    value += step;
    if (!std::isfinite(value) || value <= 0) return;
    if (std::abs(step) < kSmallStep) break;
  }
  value_ = value;
}

template <typename Archive>
void DepthScale::Exchange(Archive& archive) {
  archive.List(views_, [&](View& view) {
    archive.Number(view.keyframe_id);
    ExchangePose(archive, view.T_cam_ref_then);
    archive.Optional(view.T_ref_cam, [&](Pose& pose) { ExchangePose(archive, pose); });
  });
  archive.List(places_, [&](Eigen::Vector3d& place) { ExchangeMatrix(archive, place); });
  archive.Number(value_);
  RequireSound(archive, value_ >= kLeastScaleOfState && value_ <= kMostOfState);
}

template void DepthScale::Exchange(ByteWriter& archive);
template void DepthScale::Exchange(ByteReader& archive);

}  // namespace mono3d
