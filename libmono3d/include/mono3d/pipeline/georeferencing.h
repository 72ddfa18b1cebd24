// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// The cameras that positions may belong to: by time every tracked frame, by name the keyframes, of
// photographs all.
std::vector<PositionedCamera> PositionedCamerasOf(const MapReconstruction& map,
                                                  PositionClock clock);

// Which way is up in a map that is in its tracker's own axes: by the gimbal angles of the
// positions, or by ChooseWorldAxes with `turn_deg`.
std::optional<UpDirection> UpOf(const MapReconstruction& map,
                                const std::vector<PositionedCamera>& cameras,
                                const PositionTrack& track, int turn_deg);

// Moves a map that is in its tracker's own axes onto the earth, by the positions that the cameras
// were told to be at: metres, x east, y north, z up of the first fix. map.georeference is set, and
// map.axes. Where the positions do not determine that, nothing moves, and map.why_no_georeference
// says why. Maps of one run come into one frame. Which way is up is known beforehand by UpOf.
void PlaceOnEarth(const PositionTrack& track, const GeoreferenceOptions& options, int turn_deg,
                  MapReconstruction& map);

}  // namespace mono3d
