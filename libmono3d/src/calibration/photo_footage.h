// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
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
  // Of several cameras: which took a photo, by the index of its frame.
  PhotoFootage(FrameSource& source, std::span<const CameraModel> read_with,
               const std::function<std::size_t(std::int64_t)>& camera_of_frame,
               const PhotoMapperOptions& options);

  // The maps that the photos make if `camera` took them, with pixels as it shows them. Of the
  // points at most so many that one adjustment with the camera is a matter of seconds: those that
  // most photos show.
  std::vector<SparseModel> Map(const CameraModel& camera) const;
  // Of several cameras, which the images of the maps name. They are placed with the pixels that
  // `common` has, which has no distortion. Images have the id and the name of their frame.
  std::vector<SparseModel> Map(std::span<const CameraModel> cameras,
                               const CameraModel& common) const;

 private:
  struct Photo {
    std::int64_t frame_index = 0;
    std::string name;
    double timestamp_s = 0;
  };

  PhotoMapperOptions options_;
  std::vector<tracking::PhotoFeatures> photos_;  // with pixels as taken
  std::vector<std::size_t> camera_of_;           // each photo
  std::vector<Photo> known_;                     // of each photo
  std::vector<tracking::PhotoPair> pairs_;
};

}  // namespace mono3d::calibration
