// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::synthetic {

// The way from 0 to `distance`, from rest to rest, with smooth starts and stops: the speed follows
// 3 x^2 - 2 x^3 over a ramp. A way too short for the speed is flown slower.
class SmoothWay {
 public:
  SmoothWay(double distance, double speed, double ramp_s);

  double duration_s() const { return duration_s_; }
  double At(double t_s) const;

 private:
  double distance_;
  double speed_;
  double ramp_s_;
  double duration_s_;
};

}  // namespace mono3d::synthetic
