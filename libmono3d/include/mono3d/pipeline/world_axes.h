// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geometry/up.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

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
