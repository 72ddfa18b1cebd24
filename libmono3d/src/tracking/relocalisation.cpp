// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/relocalisation.h"

#include <algorithm>
#include <vector>

namespace mono3d::tracking {
namespace {

// The keyframes that look most like the view, then the newest.
std::vector<KeyframeId> Candidates(const Map& map, const PlaceIndex& places, const View& view) {
  constexpr std::size_t kMaxCandidates = 8;
  std::vector<KeyframeId> candidates;
  for (const PlaceMatch& place : LikelyPlaces(map, places, view)) {
    candidates.push_back(place.keyframe);
  }
  for (KeyframeId id = map.keyframes().size(); id-- > 0 && candidates.size() < kMaxCandidates;) {
    const bool is_listed = std::find(candidates.begin(), candidates.end(), id) != candidates.end();
    if (map.keyframe(id).alive && !is_listed) candidates.push_back(id);
  }
  return candidates;
}

}  // namespace

std::vector<PlaceMatch> LikelyPlaces(const Map& map, const PlaceIndex& places, const View& view) {
  constexpr std::size_t kMaxPlaces = 5;
  std::vector<PlaceMatch> likely = places.Query(view.features, kMaxPlaces);
  std::erase_if(likely,
                [&](const PlaceMatch& place) { return !map.keyframe(place.keyframe).alive; });
  return likely;
}

PoseResult RelocaliseInMap(Map& map, const PlaceIndex& places, View& view, int min_inliers,
                           int seed) {
  const int needed = min_inliers * 5 / 3;
  PoseResult best;
  for (const KeyframeId id : Candidates(map, places, view)) {
    PoseResult pose = Relocalise(map, id, view, seed);
    if (pose.num_inliers >= 10) pose = TrackLocalMap(map, view);
    if (pose.num_inliers >= needed) return pose;
    if (pose.num_inliers > best.num_inliers) best = pose;
  }
  best.num_inliers = std::min(best.num_inliers, min_inliers - 1);
  return best;
}

}  // namespace mono3d::tracking
