// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// Moves a map that is in its tracker's own axes onto the earth, by the positions that the cameras
// were told to be at: metres, x east, y north, z up of the first fix. map.georeference is set, and
// map.axes. Where the positions do not determine that, nothing moves, and map.why_no_georeference
// says why. Maps of one run come into one frame. Which way is up is known beforehand by the gimbal
// angles of the positions, or by ChooseWorldAxes with `turn_deg`.
void PlaceOnEarth(const PositionTrack& track, const GeoreferenceOptions& options, int turn_deg,
                  MapReconstruction& map);

}  // namespace mono3d
