// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_features.h"
#include "tracking/photos/photo_matching.h"

namespace mono3d::calibration {

// Photographs, matched once, to be placed with one camera after the other.
class PhotoFootage {
 public:
  // Reads all photos of the source, which takes out the distortion of `read_with`. A source that
  // breaks off with an error is good up to there.
  PhotoFootage(FrameSource& source, const CameraModel& read_with,
               const PhotoMapperOptions& options);

  // The maps that the photos make if `camera` took them, with pixels as it shows them. Of the
  // points at most so many that one adjustment with the camera is a matter of seconds: those that
  // most photos show.
  std::vector<SparseModel> Map(const CameraModel& camera) const;

 private:
  PhotoMapperOptions options_;
  std::vector<tracking::PhotoFeatures> photos_;  // with pixels as taken
  std::vector<tracking::PhotoPair> pairs_;
};

}  // namespace mono3d::calibration
