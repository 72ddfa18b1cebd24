// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "synthetic/scene.h"

namespace mono3d::synthetic {

// Small scenes with a depth that can be written down, for tests.
struct PlaneOptions {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // on the plane, in its middle
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // towards the cameras, any length but zero
  double half_extent_m = 200;
  std::uint32_t seed = 1;
};

// A square of noise with the same contrast at every scale.
Scene BuildPlane(const PlaneOptions& options = {});

struct PlaneAndBoxOptions {
  PlaneOptions plane;  // its normal is vertical
  // The box stands on the plane, its edges along the axes, its middle at `plane.point`.
  Eigen::Vector3d box_size_m = {12, 10, 8};
};
Scene BuildPlaneAndBox(const PlaneAndBoxOptions& options = {});

}  // namespace mono3d::synthetic
