// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// One image of the video, free of distortion: `camera` has none.
struct Frame {
  std::int64_t index = 0;  // position in the source, before any stride; names output files
  double timestamp_s = 0;
  std::string name;  // file name or "video.mp4#12", for messages
  cv::Mat bgr;       // CV_8UC3, camera.height x camera.width
  CameraModel camera;
  // The camera as it took the image, with its distortion, at the size of the image: where it has a
  // rolling shutter, its lines are read one after the other. Width 0: a global shutter.
  CameraModel sensor = {};
  // The part that the camera took, where the image is larger: what lies around it repeats its
  // border and shows nothing. Empty: all of it.
  cv::Rect content = {};

  // Never empty.
  cv::Rect ContentOrAll() const;
  // Was the pixel taken: does it lie within the outermost pixel centres of the content?
  bool Shows(const Eigen::Vector2d& pixel) const;
};

// CV_8UC1 of the same size.
cv::Mat ToGrey(const cv::Mat& bgr);

// Throws Error unless the frame's image is CV_8UC3 (in words: 8-bit colour) of the camera's size
// and the camera is valid and without distortion.
void Validate(const Frame& frame);

}  // namespace mono3d
