// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_tracks.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/disjoint_sets.h"

namespace mono3d::tracking {
namespace {

void DropPhotosTwice(PhotoTrack& track) {
  std::map<std::size_t, int> times;
  for (const PhotoObservation& observation : track.observations) ++times[observation.photo];
  std::erase_if(track.observations,
                [&](const PhotoObservation& observation) { return times[observation.photo] > 1; });
}

}  // namespace

std::vector<PhotoTrack> JoinPhotoMatches(const std::vector<PhotoFeatures>& photos,
                                         std::span<const PhotoPair> pairs) {
  std::vector<std::size_t> first(photos.size() + 1, 0);  // number of each photo's first feature
  for (std::size_t i = 0; i < photos.size(); ++i) first[i + 1] = first[i] + photos[i].size();
  DisjointSets<std::size_t> sets(first.back());
  for (const PhotoPair& pair : pairs) {
    for (const FeatureMatch& match : pair.matches) {
      sets.Join(first[pair.a] + match.feature_a, first[pair.b] + match.feature_b);
    }
  }
  std::map<std::size_t, PhotoTrack> track_of;
  for (std::size_t photo = 0; photo < photos.size(); ++photo) {
    for (std::size_t feature = 0; feature < photos[photo].size(); ++feature) {
      track_of[sets.Find(first[photo] + feature)].observations.push_back({photo, feature});
    }
  }
  std::vector<PhotoTrack> tracks;
  for (auto& [leader, track] : track_of) {
    if (track.observations.size() < 2) continue;
    DropPhotosTwice(track);
    if (track.observations.size() >= 2) tracks.push_back(std::move(track));
  }
  return tracks;
}

}  // namespace mono3d::tracking
