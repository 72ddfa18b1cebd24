// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <vector>

#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_scene.h"

namespace mono3d::tracking {

// Joins maps of the same photos that show the same place, each to the largest that it fits to.
// A photo may have too few points of the other map for a pose of its own, or of a part of the view
// that nobody else saw there, while all of them together leave one position and scale of the two.
// `is_free`: the photos that are in no map; those that find a place in a joined map are not,
// afterwards. `scene` is left with any of them.
void JoinPhotoMaps(PhotoScene& scene, std::vector<PlacedScene>& maps, std::vector<char>& is_free,
                   std::span<const PhotoTime> times, const PhotoMapperOptions& options);

}  // namespace mono3d::tracking
