// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_features.h"

namespace mono3d::tracking {

// A photo that has a pose.
struct PlacedPhoto {
  std::size_t photo = 0;
  Pose T_world_cam;
};

// Photos that hang together. The world is the camera of the first photo, and the median depth there
// is 1 su.
struct PhotoMap {
  std::vector<PlacedPhoto> photos;  // in the order in which they were placed
  // The points, and the photos in the same order; their ids are positions in the list of photos.
  SparseModel sparse;
};

struct PhotoMaps {
  std::vector<PhotoMap> maps;        // the one with most photos first
  std::vector<std::string> reasons;  // of each photo, why it is in none; else empty
};

// Places photos whose features have the pixels of `camera`, which has no distortion. The same
// photos in another order make the same maps.
PhotoMaps MapPhotos(const std::vector<PhotoFeatures>& photos, const CameraModel& camera,
                    const PhotoMapperOptions& options, StageTimes* times);

}  // namespace mono3d::tracking
