// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tracking/photos/photo_matching.h"

namespace mono3d::tracking {

struct PhotoObservation {
  std::size_t photo = 0;
  std::size_t feature = 0;
  bool fits = false;  // the photo has a pose, and shows the point there
};

// One place of the scene and the photos that show it, each once.
struct PhotoTrack {
  std::vector<PhotoObservation> observations;  // by ascending photo
  std::optional<Eigen::Vector3d> p_world;
};

// Joins matches that share features. A photo that shows a track twice is left out of it: one of the
// two is wrong.
std::vector<PhotoTrack> JoinPhotoMatches(const std::vector<PhotoFeatures>& photos,
                                         std::span<const PhotoPair> pairs);

}  // namespace mono3d::tracking
