// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/mesh.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {

inline constexpr float kStorey_m = 2.8F;
// Walls go on below the floor, so that slopes leave no gap.
inline constexpr float kFoundation_m = 3;

// One upright wall: its lower left corner at floor level as seen from outside, and its directions.
struct Wall {
  Eigen::Vector3f corner;
  Eigen::Vector3f along;     // unit length
  Eigen::Vector3f outwards;  // unit length
  float length_m;
};

// A rectangle on a wall.
struct Opening {
  float along_m;   // of its middle
  float height_m;  // of its middle
  float width_m;
  float tall_m;
};

// A slab that lies on the wall.
void AddSlab(Mesh& mesh, const Wall& wall, const Opening& opening, float thickness_m,
             const Finish& finish);

// Pane, frame and sill. `random` chooses what is behind the pane.
void AddWindow(Mesh& mesh, const Wall& wall, const Opening& pane, RandomNumbers& random);

// To the left and right of a window.
void AddShutters(Mesh& mesh, const Wall& wall, const Opening& pane, const Finish& finish);

}  // namespace mono3d::synthetic
