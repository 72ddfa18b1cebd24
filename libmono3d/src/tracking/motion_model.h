// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "tracking/velocity_prior.h"

namespace mono3d::tracking {

// The motion that lasts `factor` times as long at the same speed and rate of turn.
Pose ScaleMotion(const Pose& motion, double factor);

// How the camera moves, by the last tracked frames. A prediction takes the last motion at constant
// velocity.
class MotionModel {
 public:
  // The motion from the frame before to the last one, and how long it took.
  void Add(const Pose& T_current_previous, double duration_s);
  // The frame `num_before` frames before the last one turned out to be elsewhere by T_new_old, in
  // its axes.
  void Move(std::size_t num_before, const Pose& T_new_old);
  void Reset() { *this = {}; }
  // Nothing but how it will go on.
  void Expect(const Pose& T_next_current, double duration_s);
  // The last motion, or the one expected; nothing where neither is known.
  std::optional<Pose> last() const;
  // The motion from the last frame to one `duration_s` later, also over frames left out.
  std::optional<Pose> Predict(double duration_s) const;
  // At the frame `num_before` frames before the last one, 0 to kMaxMotions: by a polynomial in time
  // through it and up to kMaxOnSide frames on each side, which shaking by hand and by rotors needs.
  // Zero where nothing is known.
  VelocityPrior Velocity(std::size_t num_before) const;
  // The lengths of the world were multiplied.
  void Rescale(double ratio);

  // Of a shake at a fifth, three tenths and two fifths of the frame rate one frame on each side
  // tells .76, .50 and .23, two tell .93, .73 and .38, four .99, .91 and .56, six 1.00, .97, .67.
  static constexpr std::size_t kMaxOnSide = 6;
  static constexpr std::size_t kMaxMotions = 2 * kMaxOnSide;

  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  struct Motion {
    Pose T_later_earlier;
    double duration_s = 0;
  };

  // The last one, or the one expected where there is none yet.
  std::optional<Motion> Latest() const;
  std::vector<LaterPose> Neighbours(std::size_t motion, std::size_t on_side) const;

  std::optional<Motion> expected_;
  std::vector<Motion> motions_;  // the last kMaxMotions, in the order in which they were tracked
};

}  // namespace mono3d::tracking
