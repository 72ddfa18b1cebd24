// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// Which way is up in a world, as a unit vector: not measured, but found as the direction
// - to which the cameras' right axes are perpendicular: cameras are held, or hung, level;
// - to which the steps between the cameras are perpendicular, or else parallel: flights are mostly
//   level ones, and drones rise and sink;
// - in which more of the surface faces than in others: ground and roofs;
// among those in which no camera is upside down or looks steeply up. Where the cameras turn, the
// first of these decides. Nothing of fewer than three cameras, which are in the order of their
// images, or where no direction is possible. `normals`: of the surface; some 1,500 of them are
// asked. `turn_deg`: ReadShownTurn of the images, which are not turned themselves.
std::optional<Eigen::Vector3d> FindUp(std::span<const Pose> T_world_cam,
                                      std::span<const Eigen::Vector3f> normals, int turn_deg = 0);

// Axes to look at a map by, in place of those of its first camera: z up as FindUp finds it, y where
// the first camera looks, x to its right; the origin in the middle of the model, on the ground. The
// unit of length stays: it is the distance of what the camera saw when the map began, and that of
// the depth maps. Where up is not found: its own axes, source kFirstCamera.
WorldAxes ChooseWorldAxes(const MapReconstruction& map, int turn_deg = 0);

// Is z up? It is not in the axes of a first camera, nor in those of a saved map that has kept them.
bool IsLevel(const WorldAxes& axes);

// Moves everything of the map that is in its world.
void MoveWorld(const Similarity& S_new_old, MapReconstruction& map);

// The same into these axes; they become map.axes.
void MoveInto(const WorldAxes& axes, MapReconstruction& map);

}  // namespace mono3d
