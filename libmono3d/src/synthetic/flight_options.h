// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

#include "mono3d/core/options.h"

namespace mono3d::synthetic {

// How far a hand-flown camera strays from its path: smooth, seeded, without swings slower or faster
// than the band.
struct UnsteadinessOptions {
  double position_m = 0;    // standard deviation, each axis of the camera
  double rotation_deg = 0;  // standard deviation, each axis of the camera
  double lowest_hz = 0.05;  // of the swings
  double highest_hz = 0.8;
  int seed = 1;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// What a flight can be.
//   orbit          on a circle around the target, looking at it
//   lawnmower      straight rows to and fro, looking ahead and down; the turns are half circles
//   cruise         straight on, looking ahead and down
//   lateral        straight on, looking to the left and down
//   take_off       straight up over the target from take_off_height_m to height_m, the view
//                  pitching down from the horizon to pitch_deg on the way; then a cruise, if time
//                  is left
//   stop_and_turn  a cruise that stops in the middle, hovers, yaws in place by turn_deg and flies
//                  on where it looks then; with sideways_s it begins to the right instead of ahead
// and those that consumer drones fly by themselves, about the target, from take_off_height_m up to
// height_m, as far as the time allows; there they hover for the rest of it:
//   rocket         straight up, looking straight down
//   dronie         backwards and up, looking at the target; it ends radius_m away from it and comes
//                  from there in a straight line
//   helix          the same once around the target, its circle growing
inline constexpr std::array<const char*, 9> kFlightKinds = {"orbit",   "lawnmower", "cruise",
                                                            "lateral", "take_off",  "stop_and_turn",
                                                            "rocket",  "dronie",    "helix"};

struct FlightOptions {
  std::string kind = "orbit";  // one of kFlightKinds
  // Of what the flight is about: what an orbit, take_off, rocket, dronie or helix is over or
  // around; of the others, the mean of the places on the ground that the camera looks at.
  double target_x_m = 0;
  double target_y_m = 0;
  double height_m = 71;          // above the mean ground below the flight, or that at the target
  double speed_m_per_s = 1.4;    // along the path, once under way
  double duration_s = 120;       // from standstill to standstill
  double ramp_s = 3;             // that speeding up takes, and slowing down; above 0
  double heading_deg = 0;        // of the flight, from the world's x axis towards y
  double pitch_deg = 40;         // of the view below the horizon, 0 to 90; not of orbit,
                                 // rocket, dronie and helix, which look at the target
  double radius_m = 80;          // orbit, dronie, helix (at its end): in the horizontal plane
  double start_deg = 0;          // orbit, helix: of the camera's place, from the x axis towards y
  bool full_circle = false;      // orbit: fly once round, end where it began; duration_s is ignored
  double row_length_m = 80;      // lawnmower
  double row_spacing_m = 25;     // lawnmower
  double take_off_height_m = 5;  // above the ground
  double turn_deg = 60;          // stop_and_turn, left positive
  double turn_deg_per_s = 8;     // stop_and_turn: yaw rate
  double sideways_s = 0;         // stop_and_turn: of a flight to the right, in place of the cruise
  double arm_m = 0;              // stop_and_turn: the camera is so far ahead of the axis of yaw
  double hover_s = 0;            // stop_and_turn: standstill before the turn
  double climb_deg = 0;          // stop_and_turn: of the path after the turn, above the horizon
  UnsteadinessOptions unsteadiness;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

}  // namespace mono3d::synthetic
