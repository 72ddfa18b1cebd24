// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/image/frame.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"

namespace mono3d {

// Makes frames of images as a camera took them. Any thread.
class CapturedFrameUndistorter {
 public:
  // Throws Error as Undistorter.
  explicit CapturedFrameUndistorter(const CameraModel& camera);

  // The image is shared where there is no distortion.
  Frame Undistort(const CapturedFrame& captured) const;
  const CameraModel& undistorted() const { return undistorter_.camera(); }
  const CameraModel& camera() const { return camera_; }

 private:
  CameraModel camera_;
  Undistorter undistorter_;
};

// Throws Error unless the image is CV_8UC3 of the camera's size.
void RequireImageOf(const CameraModel& camera, const CapturedFrame& captured);

// Throws Error unless `next` has a higher index than `captured` and is not of an earlier time.
void RequireOrder(const CapturedFrame& captured, const CapturedFrame& next);

// A frame whose pixels nobody else can change: where others hold the image, it is copied.
CapturedFrame WithOwnPixels(CapturedFrame captured);

}  // namespace mono3d
