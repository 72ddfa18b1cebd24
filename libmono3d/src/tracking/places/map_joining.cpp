// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/map_joining.h"

#include <utility>

#include "tracking/places/loop_closing.h"

namespace mono3d::tracking {

std::vector<PlaceMatch> LikelyPlaces(const Map& map, KeyframeId keyframe, const Map& other,
                                     const PlaceIndex& places_of_other) {
  const std::vector<Feature> features = FeaturesWithPoints(map.keyframe(keyframe).view);
  std::vector<PlaceMatch> likely = places_of_other.Query(features, kMaxPlaceCandidates);
  std::erase_if(likely, [&](const PlaceMatch& match) {
    return match.num_votes < kMinVotes || !other.keyframe(match.keyframe).alive;
  });
  return likely;
}

std::optional<PlaceFound> FindInOtherMap(const Map& map, KeyframeId keyframe, Map& other,
                                         const PlaceIndex& places_of_other, int seed) {
  for (const PlaceMatch& match : LikelyPlaces(map, keyframe, other, places_of_other)) {
    std::optional<PlaceFound> found = MatchPlace(map, keyframe, other, match.keyframe, seed);
    if (found) return found;
  }
  return std::nullopt;
}

Similarity SimilarityOf(const PlaceFound& place, const Map& map) {
  return Similarity(1, place.T_cam_world.Inverse()) * Similarity(place.scale, Pose()) *
         Similarity(1, map.T_cam_world(place.keyframe));
}

NumberShift JoinMaps(Map& map, PlaceIndex& places, Map& added, PlaceFound place,
                     const LocalMappingOptions& options, MappingLock& lock) {
  const NumberShift shift{map.keyframes().size(), static_cast<std::uint32_t>(map.points().size())};
  map.Append(std::move(added), SimilarityOf(place, added));
  for (KeyframeId id = shift.keyframes; id < map.keyframes().size(); ++id) {
    if (map.keyframe(id).alive) places.Add(id, FeaturesWithPoints(map.keyframe(id).view));
  }
  place.keyframe += shift.keyframes;
  for (auto& [own, old] : place.same) own.index += shift.points;
  MergePlaces(map, place, options, lock);
  return shift;
}

}  // namespace mono3d::tracking
