// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_features.h"
#include "tracking/photos/photo_matching.h"
#include "tracking/photos/photo_scene.h"

namespace mono3d::tracking {

// A photo that has a pose.
struct PlacedPhoto {
  std::size_t photo = 0;
  Pose T_world_cam;
};

// Photos that hang together. The world is the camera of the first photo, and the median depth there
// is 1 su.
struct PhotoMap {
  std::vector<PlacedPhoto> photos;  // as a walk would go, next to each other where they can be
  // The points, and the photos in the same order; their ids are positions in the list of photos.
  SparseModel sparse;
};

struct PhotoMaps {
  std::vector<PhotoMap> maps;        // the one with most photos first
  std::vector<std::string> reasons;  // of each photo, why it is in none; else empty
};

// Places photos whose features have the pixels of `camera`, which has no distortion; `pairs` are
// those of MatchPhotos. `tolerance`: by how much the errors of a camera that is not known exactly
// exceed those of the features. `times`: of each photo, where they are the frames of a video; else
// empty. Poses are then those of the middle lines.
PhotoMaps MapPhotos(const std::vector<PhotoFeatures>& photos, const std::vector<PhotoPair>& pairs,
                    const CameraModel& camera, const PhotoMapperOptions& options,
                    double tolerance = 1, std::span<const PhotoTime> times = {});

// Sorts photos by what they show, so that nothing rests on the order in which they came.
std::vector<std::size_t> OrderOfContent(const std::vector<PhotoFeatures>& photos);

}  // namespace mono3d::tracking
