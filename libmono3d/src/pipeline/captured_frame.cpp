// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/captured_frame.h"

#include <string>

#include "mono3d/core/error.h"

namespace mono3d {

CapturedFrameUndistorter::CapturedFrameUndistorter(const CameraModel& camera)
    : camera_(camera), undistorter_(camera) {}

Frame CapturedFrameUndistorter::Undistort(const CapturedFrame& captured) const {
  Frame frame;
  frame.index = captured.index;
  frame.timestamp_s = captured.timestamp_s;
  frame.name = captured.name;
  frame.bgr = undistorter_.Undistort(captured.bgr);
  frame.camera = undistorter_.camera();
  if (!camera_.shutter.IsGlobal()) frame.sensor = camera_;
  return frame;
}

void RequireImageOf(const CameraModel& camera, const CapturedFrame& captured) {
  CameraModel pinhole = camera;
  pinhole.distortion = {};
  Validate(Frame{captured.index, captured.timestamp_s, captured.name, captured.bgr, pinhole});
}

void RequireOrder(const CapturedFrame& captured, const CapturedFrame& next) {
  if (next.index > captured.index && next.timestamp_s >= captured.timestamp_s) return;
  throw Error(ErrorParts{.what = "frames are not in the order of time",
                         .where = next.name,
                         .expected = "one after frame " + std::to_string(captured.index) + " at " +
                                     std::to_string(captured.timestamp_s) + " s",
                         .found = "frame " + std::to_string(next.index) + " at " +
                                  std::to_string(next.timestamp_s) + " s"});
}

CapturedFrame WithOwnPixels(CapturedFrame captured) {
  const cv::Mat& bgr = captured.bgr;
  const bool is_own = bgr.u != nullptr && bgr.u->refcount == 1;
  if (!is_own) captured.bgr = bgr.clone();
  return captured;
}

}  // namespace mono3d
