// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geo/ground_control.h"
#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/pipeline/stages.h"

namespace MONO3D_EXPORT mono3d {

// The cameras that positions may belong to: by time every tracked frame, by name the keyframes, of
// photographs all.
std::vector<PositionedCamera> PositionedCamerasOf(const MapReconstruction& map,
                                                  PositionClock clock);

// The frames that ground control points may be marked in: all that were tracked, by index. How each
// moved comes from those before and after it, and means nothing of photographs in any order.
std::vector<FrameInMap> FramesOf(const MapReconstruction& map);

// Which way is up in a map that is in its tracker's own axes: by the gimbal angles of the
// positions, or by ChooseWorldAxes with `turn_deg`.
std::optional<UpDirection> UpOf(const MapReconstruction& map,
                                const std::vector<PositionedCamera>& cameras,
                                const PositionTrack& track, int turn_deg);

// Where a map that is in its tracker's own axes is on the earth: by the ground control points where
// these determine it, else by the positions, and then with what the control points are off by. All
// maps of a run have one origin.
GeoreferenceResult FindPlaceOnEarth(const MapReconstruction& map,
                                    const PipelinePositions& positions);

// What Tracker::FollowPositions is to be told of such a map: the positions, and the ground control
// points where these determine the place, but for those that contradict the others. Nothing where
// neither determines the place. Beside control points, heights of positions count from wherever
// these have them: their median difference is taken out.
std::optional<CameraPositions> PositionsToFollow(const MapReconstruction& map,
                                                 const PipelinePositions& positions);

// The same of photographs that have been placed, by their positions alone: for
// CalibrateCameraOfPhotos. Nothing where the positions do not belong to images by name.
std::optional<CameraPositions> PositionsOfPhotos(const SparseModel& map,
                                                 const PipelinePositions& positions);

// Moves a map that is in its tracker's own axes onto the earth, by FindPlaceOnEarth: metres, x
// east, y north, z up of the origin. map.georeference is set, and map.axes. Where nothing
// determines that, nothing moves, and map.why_no_georeference says why. Maps of one run come into
// one frame.
void PlaceOnEarth(const PipelinePositions& positions, MapReconstruction& map);
// The same by a georeference that is known.
void PlaceOnEarth(Georeference georeference, MapReconstruction& map);

}  // namespace mono3d
