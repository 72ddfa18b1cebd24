// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <string>
#include <vector>

#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_scene.h"

namespace mono3d::tracking {

// Places as many of the photos for which `is_free` holds as hang together, from the best pair of
// them on. How many it has placed, 0 where there is no start; `scene` holds them. `reason`: of no
// start, why. `times`: of each photo, where they are the frames of a video; else empty.
int GrowPhotoMap(PhotoScene& scene, std::span<const PhotoPair> pairs,
                 const std::vector<char>& is_free, std::span<const PhotoTime> times,
                 const PhotoMapperOptions& options, std::string& reason);

// Goes on with what `scene` holds: adjusts it, takes photos out that do not fit and places free
// ones that do.
void CompletePhotoMap(PhotoScene& scene, const std::vector<char>& is_free,
                      std::span<const PhotoTime> times, const PhotoMapperOptions& options);

// Poses and points are adjusted: while photos come, since the next adjustment moves all again; in
// the end.
inline constexpr double kGrowingMinGain = 1e-3;
inline constexpr double kFinalMinGain = 1e-5;

}  // namespace mono3d::tracking
