// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>

#include "mono3d/core/options.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/sensor_options.h"

namespace mono3d::synthetic {

struct RenderOptions {
  int samples_per_side = 2;  // samples a pixel, squared; motion blur takes more as it needs them
  bool with_depth = true;
  SensorOptions sensor;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Pose T_world_cam at each time. Called from one thread.
using CameraMotion = std::function<Pose(double t_s)>;

// One release of the shutter.
struct Shot {
  CameraMotion motion;  // about t_s, as far as shutter and readout reach
  double t_s = 0;       // the middle of the exposure of the middle line: the time of the true pose
  int frame = 0;        // each frame has noise of its own
};

}  // namespace mono3d::synthetic
