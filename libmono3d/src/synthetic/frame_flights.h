// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono3d/core/options.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::synthetic {

// Flights as lists of frames, an equal step from each to the next: for tests and examples that
// have no clock.

// How far a hand-flown camera strays from its path: smooth, seeded, some frames long each swing.
struct FrameUnsteadinessOptions {
  double position_m = 0.25;   // standard deviation, each axis
  double rotation_deg = 0.3;  // standard deviation, each axis
  int seed = 1;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// On a circle around `target`, looking at it.
struct OrbitOptions {
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  int num_frames = 90;
  double radius_m = 68;    // in the horizontal plane
  double height_m = 46;    // above the target
  double start_deg = 0;    // of the camera's place, from the world's x axis towards y
  double step_deg = 0.95;  // per frame
  FrameUnsteadinessOptions unsteadiness;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};
std::vector<Pose> OrbitFlight(const OrbitOptions& options);

// On a straight line, looking to its left and down.
struct LateralOptions {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  int num_frames = 90;
  double heading_deg = 0;  // of the flight, from the world's x axis towards y
  double step_m = 1;       // per frame
  double pitch_deg = 35;   // of the view below the horizon, under 90
  FrameUnsteadinessOptions unsteadiness;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};
std::vector<Pose> LateralFlight(const LateralOptions& options);

}  // namespace mono3d::synthetic
