// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/pipeline/next_views.h"
#include "pipeline/surface_cells.h"

namespace mono3d {

// A cell that should be seen again.
struct WantedPlace {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of kHidden: towards what was seen through
  ViewNeed need = ViewNeed::kHidden;
  double area_su2 = 0;  // less, the farther it is from the flight
  // Towards the two cameras, of those that saw it, that are farthest from each other.
  std::array<Eigen::Vector3d, 2> seen_from = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

  // How much of it a camera in this direction shows that has a clear sight of it, from 0 to 1; 0
  // where it would not help.
  double ShareShownFrom(const Eigen::Vector3d& towards_camera) const;
};

// Where `views`, from about `distance_su` away, have left something to be seen. `camera` is small:
// its pixels are not much finer than the cells.
std::vector<WantedPlace> FindWantedPlaces(const CellGrid& grid, std::span<const Pose> views,
                                          const CameraModel& camera, double distance_su,
                                          const Eigen::Vector3d& up);

}  // namespace mono3d
