// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <numbers>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// Takes the distortion of a lens out of images. The maps are made once.
class Undistorter {
 public:
  // How far off the axis of a fisheye lens the corners of its undistorted images look at most.
  static constexpr double kMaxFisheyeAngle_rad = std::numbers::pi / 3;

  // Throws Error when the distortion coefficients do not describe a lens over the whole image (of a
  // fisheye lens: over what is used of it), that is, when two pixels look the same way.
  explicit Undistorter(const CameraModel& distorted);
  // Into the images of `common`, which is free of distortion and may be of another size; its axes
  // are the camera's. They show no more of the field of view than without it. Throws Error as
  // above, and where `common` shows nothing of it.
  Undistorter(const CameraModel& distorted, const CameraModel& common);

  // Of the images that come out: same size, no distortion nor shutter, and the largest field of
  // view in which every pixel has content. The same lens when there is no distortion.
  //
  // Of a fisheye lens that field of view ends 60 degrees off the axis, in the corners, and pixels
  // are square. A pinhole image of a hemisphere would be infinitely large; at 60 degrees it is
  // stretched fourfold outwards and twofold around against its middle, where correlation of square
  // patches gets poor. The same size then leaves the middle 0.8 to 1.2 of the resolution that the
  // lens has there, for 110 to 200 degrees across the width; what lies beyond is not seen.
  const CameraModel& camera() const { return camera_; }

  // The part of these images that has content; around it they repeat its border.
  const cv::Rect& content() const { return content_; }

  // `image` has the distorted camera's size and any 8-bit type. Without distortion this is the
  // image itself, not a copy.
  cv::Mat Undistort(const cv::Mat& image) const;

 private:
  void TakeMaps(const CameraModel& distorted);

  CameraModel camera_;
  cv::Size taken_size_;  // of the images that go in
  cv::Rect content_;
  cv::Mat map1_;  // of the content, CV_16SC2; empty where images stay as they are
  cv::Mat map2_;
};

}  // namespace mono3d
