// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

#include <cmath>

namespace mono3d::tracking {
namespace {

// From a to b by the share.
CameraVelocity Between(const CameraVelocity& a, const CameraVelocity& b, double share) {
  return {a.angular_rad_per_s + share * (b.angular_rad_per_s - a.angular_rad_per_s),
          a.linear_su_per_s + share * (b.linear_su_per_s - a.linear_su_per_s)};
}

}  // namespace

Pose ScaleMotion(const Pose& motion, double factor) {
  return {RotationExp(factor * RotationLog(motion.rotation())), factor * motion.translation()};
}

void MotionModel::Set(const Pose& T_current_previous, double duration_s) {
  if (T_current_previous_) {
    velocity_before_ = VelocityOf(*T_current_previous_, duration_s_);
    duration_before_s_ = duration_s_;
  }
  T_current_previous_ = T_current_previous;
  duration_s_ = duration_s;
}

void MotionModel::Improve(const Pose& T_current_previous) {
  T_current_previous_ = T_current_previous;
}

// The velocity of a motion is that in the middle of it.
CameraVelocity MotionModel::Velocity() const {
  if (!T_current_previous_) return {};
  const CameraVelocity last = VelocityOf(*T_current_previous_, duration_s_);
  const double sum_s = std::abs(duration_before_s_) + std::abs(duration_s_);
  if (!velocity_before_ || sum_s == 0) return last;
  return Between(*velocity_before_, last, 1 + std::abs(duration_s_) / sum_s);
}

CameraVelocity MotionModel::VelocityBefore() const {
  if (!T_current_previous_) return {};
  const CameraVelocity last = VelocityOf(*T_current_previous_, duration_s_);
  const double sum_s = std::abs(duration_before_s_) + std::abs(duration_s_);
  if (!velocity_before_ || sum_s == 0) return last;
  return Between(*velocity_before_, last, std::abs(duration_before_s_) / sum_s);
}

std::optional<Pose> MotionModel::Predict(double duration_s) const {
  if (!T_current_previous_) return std::nullopt;
  return ScaleMotion(*T_current_previous_, duration_s_ > 0 ? duration_s / duration_s_ : 1);
}

void MotionModel::Rescale(double ratio) {
  if (velocity_before_) velocity_before_->linear_su_per_s *= ratio;
  if (!T_current_previous_) return;
  T_current_previous_ =
      Pose(T_current_previous_->rotation(), ratio * T_current_previous_->translation());
}

}  // namespace mono3d::tracking
