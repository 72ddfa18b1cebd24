// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// The motion that lasts `factor` times as long at the same speed and rate of turn.
Pose ScaleMotion(const Pose& motion, double factor);

}  // namespace mono3d::tracking
