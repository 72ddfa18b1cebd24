// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// The motion that lasts `factor` times as long at the same speed and rate of turn.
Pose ScaleMotion(const Pose& motion, double factor);

// How the camera moves, by the last two tracked frames: with constant velocity.
class MotionModel {
 public:
  // The motion from the frame before to the last one, and how long it took.
  void Set(const Pose& T_current_previous, double duration_s);
  void Reset() { T_current_previous_.reset(); }
  // Nothing where fewer than two frames were tracked in a row.
  const std::optional<Pose>& last() const { return T_current_previous_; }
  // The motion from the last frame to one `duration_s` later, also over frames left out.
  std::optional<Pose> Predict(double duration_s) const;
  // The lengths of the world were multiplied.
  void Rescale(double ratio);

 private:
  std::optional<Pose> T_current_previous_;
  double duration_s_ = 0;
};

}  // namespace mono3d::tracking
