// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "synthetic/site.h"

namespace mono3d::synthetic {

// A rod of square section.
struct Rod {
  Eigen::Vector3f from;
  Eigen::Vector3f to;
  float thickness_m;
};
void AddRod(Mesh& mesh, const Rod& rod, const Finish& finish);

// Wooden poles (0.2 m thick) along a street with three sagging wires (0.05 m).
void AddPolesWithWires(Site& site, const Polyline& street);

// Lamp posts (0.12 m thick) along the other side of a street.
void AddStreetLamps(Site& site, const Polyline& street);

// Fences of posts and rails (0.05 to 0.1 m thick) along both sides of a street, with gaps.
void AddFences(Site& site, const Polyline& street);

// A fence between two places.
void AddFence(Site& site, const Eigen::Vector2f& from, const Eigen::Vector2f& to);

}  // namespace mono3d::synthetic
