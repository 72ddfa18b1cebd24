// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

namespace mono3d::tracking {

Pose ScaleMotion(const Pose& motion, double factor) {
  return {RotationExp(factor * RotationLog(motion.rotation())), factor * motion.translation()};
}

void MotionModel::Set(const Pose& T_current_previous, double duration_s) {
  T_current_previous_ = T_current_previous;
  duration_s_ = duration_s;
}

std::optional<Pose> MotionModel::Predict(double duration_s) const {
  if (!T_current_previous_) return std::nullopt;
  return ScaleMotion(*T_current_previous_, duration_s_ > 0 ? duration_s / duration_s_ : 1);
}

void MotionModel::Rescale(double ratio) {
  if (!T_current_previous_) return;
  T_current_previous_ =
      Pose(T_current_previous_->rotation(), ratio * T_current_previous_->translation());
}

}  // namespace mono3d::tracking
