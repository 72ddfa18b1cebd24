// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "mono3d/pipeline/georeferencing.h"

namespace mono3d {

// Both by one fit: where a map is on the earth (FindPlaceOnEarth), and what its tracker is to
// follow (PositionsToFollow).
struct MapOnEarth {
  GeoreferenceResult place;
  std::optional<CameraPositions> to_follow;
};
MapOnEarth FindMapOnEarth(const MapReconstruction& map, const PipelinePositions& positions);

}  // namespace mono3d
