// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::tracking {

// The motion that lasts `factor` times as long at the same speed and rate of turn.
Pose ScaleMotion(const Pose& motion, double factor);

// How the camera moves, by the last tracked frames: from one to the next with constant velocity.
class MotionModel {
 public:
  // The motion from the frame before to the last one, and how long it took.
  void Set(const Pose& T_current_previous, double duration_s);
  // The last motion is known better.
  void Improve(const Pose& T_current_previous);
  void Reset() { *this = {}; }
  // Nothing where fewer than two frames were tracked in a row.
  const std::optional<Pose>& last() const { return T_current_previous_; }
  // The motion from the last frame to one `duration_s` later, also over frames left out.
  std::optional<Pose> Predict(double duration_s) const;
  // At the last frame: by the motion up to it, and by the one before how that changes. Zero where
  // nothing is known.
  CameraVelocity Velocity() const;
  // At the frame before, which lies between two motions.
  CameraVelocity VelocityBefore() const;
  // The lengths of the world were multiplied.
  void Rescale(double ratio);

 private:
  std::optional<Pose> T_current_previous_;
  double duration_s_ = 0;
  std::optional<CameraVelocity> velocity_before_;  // of the motion before the last one
  double duration_before_s_ = 0;
};

}  // namespace mono3d::tracking
