// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_clock.h"

#include <algorithm>
#include <cmath>

namespace mono3d {

double LiveClock::Add(std::optional<double> stamp_s, double arrival_s) {
  // Images that arrive in one go are told apart, by less than any camera's rate.
  constexpr double kLeastStep_s = 1e-4;
  if (stamp_s && !std::isfinite(*stamp_s)) stamp_s.reset();
  double time_s = 0;
  if (stamp_s && MayFollow(*stamp_s, arrival_s)) {
    time_s = std::max(*stamp_s + shift_s_, std::nextafter(*last_s_, *stamp_s + shift_s_ + 1));
  } else {
    const bool is_new = !last_stamp_s_ && stamp_s;  // of the first image, or after a break
    if (!is_new) ++num_by_arrival_;
    if (last_s_) time_s = *last_s_ + std::max(arrival_s - last_arrival_s_, kLeastStep_s);
    if (stamp_s) shift_s_ = time_s - *stamp_s;
  }
  last_s_ = time_s;
  last_arrival_s_ = arrival_s;
  last_stamp_s_ = stamp_s;
  return time_s;
}

bool LiveClock::MayFollow(double stamp_s, double arrival_s) const {
  // More than what networks hold back: the clock of the camera was set.
  constexpr double kMaxJump_s = 10;
  if (!last_s_ || !last_stamp_s_ || !(stamp_s > *last_stamp_s_)) return false;
  return std::abs((stamp_s - *last_stamp_s_) - (arrival_s - last_arrival_s_)) <= kMaxJump_s;
}

}  // namespace mono3d
