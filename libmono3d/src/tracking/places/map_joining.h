// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"
#include "tracking/places/place_index.h"
#include "tracking/places/place_matching.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// The keyframes of another map that look most like one of this map, most votes first.
std::vector<PlaceMatch> LikelyPlaces(const Map& map, KeyframeId keyframe, const Map& other,
                                     const PlaceIndex& places_of_other);

// A place of one map that another one knows: the candidates of the other's index, checked.
std::optional<PlaceFound> FindInOtherMap(const Map& map, KeyframeId keyframe, Map& other,
                                         const PlaceIndex& places_of_other, int seed);

// Maps the world of the keyframe's map to that of the other one.
Similarity SimilarityOf(const PlaceFound& place, const Map& map);

// What a join of maps adds to the numbers of keyframes and points of the map that is added.
struct NumberShift {
  KeyframeId keyframes = 0;
  std::uint32_t points = 0;
};

// Joins two maps that share a place: moves keyframes and points of `added`, which is empty
// afterwards, into `map`, to its world and scale and with numbers after its own; then MergePlaces.
// `place`: its keyframe and first points are of `added`, the old ones of `map`.
NumberShift JoinMaps(Map& map, PlaceIndex& places, Map& added, PlaceFound place,
                     const LocalMappingOptions& options, MappingLock& lock);

}  // namespace mono3d::tracking
