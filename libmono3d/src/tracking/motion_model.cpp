// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

namespace mono3d::tracking {

Pose ScaleMotion(const Pose& motion, double factor) {
  return {RotationExp(factor * RotationLog(motion.rotation())), factor * motion.translation()};
}

}  // namespace mono3d::tracking
