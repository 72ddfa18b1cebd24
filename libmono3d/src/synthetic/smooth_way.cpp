// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/smooth_way.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {
namespace {

// Integral of 3 x^2 - 2 x^3 from 0: 1/2 at 1.
double SmoothStepIntegral(double x) { return x * x * x * (1 - x / 2); }

}  // namespace

SmoothWay::SmoothWay(double distance, double speed, double ramp_s)
    : distance_(distance), speed_(speed), ramp_s_(ramp_s) {
  if (distance_ < speed_ * ramp_s_) speed_ = distance_ / ramp_s_;
  duration_s_ = speed_ > 0 ? distance_ / speed_ + ramp_s_ : 0;
}

double SmoothWay::At(double t_s) const {
  if (t_s <= 0) return 0;
  if (t_s >= duration_s_) return distance_;
  const double rest_s = duration_s_ - t_s;
  if (t_s < ramp_s_) return speed_ * ramp_s_ * SmoothStepIntegral(t_s / ramp_s_);
  if (rest_s < ramp_s_) {
    return distance_ - speed_ * ramp_s_ * SmoothStepIntegral(rest_s / ramp_s_);
  }
  return speed_ * (t_s - ramp_s_ / 2);
}

}  // namespace mono3d::synthetic
