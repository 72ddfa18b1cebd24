// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/image/sparse_model.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// The keyframes of a map that are alive, its points, and who sees what. The id of an image is its
// KeyframeId, ascending. Features that have no point are left out.
SparseModel ToSparseModel(const Map& map);

// Gives the images of such a model the indices of their frames as ids, in ascending order: so does
// COLMAP's database number the images of a folder. Nothing where two frames have one index, as
// after footage of another flight.
void NumberByFrames(const Map& map, SparseModel& model);

}  // namespace mono3d::tracking
