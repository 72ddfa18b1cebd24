// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// Takes the distortion of a lens out of images. The maps are made once.
class Undistorter {
 public:
  // Throws Error when the distortion coefficients do not describe a lens over the whole image, that
  // is, when two pixels look the same way.
  explicit Undistorter(const CameraModel& distorted);

  // Of the images that come out: same size, no distortion nor shutter, and the largest field of
  // view in which every pixel has content. The same lens when there is no distortion.
  const CameraModel& camera() const { return camera_; }

  // `image` has the distorted camera's size and any 8-bit type. Without distortion this is the
  // image itself, not a copy.
  cv::Mat Undistort(const cv::Mat& image) const;

 private:
  CameraModel camera_;
  cv::Mat map1_;  // CV_16SC2, empty without distortion
  cv::Mat map2_;
};

}  // namespace mono3d
