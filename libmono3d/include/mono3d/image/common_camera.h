// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// A camera as it took its photos, and how many.
struct PhotosOfCamera {
  CameraModel camera;
  int num_photos = 1;
};

// The pinhole camera whose images hold those of all these cameras, free of distortion.
//
// Its focal length is the median of theirs over the photos: photos of fewer pixels for an angle are
// enlarged and show nothing new, those of more lose detail. Its field of view holds all of theirs:
// where that takes more than twice the pixels of the largest photo, the focal length is shorter.
// Twice is what holds photos of up to 2:1 held upright and lengthwise; beyond, a wide lens beside a
// long one would make most of each image empty, and time grows with the pixels, empty or not.
//
// `max_width` and `max_height` limit the size; 0: no limit. Throws Error where there is no camera,
// or where one is no lens.
CameraModel CommonCamera(std::span<const PhotosOfCamera> cameras, int max_width = 0,
                         int max_height = 0);

}  // namespace mono3d
