// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// Where a camera prior comes from.
enum class CameraPriorSource {
  kCalibration,  // a calibration file, or a camera that the caller gives
  kXmp,          // XMP of a photo: the maker's calibration of the camera
  kExif,         // EXIF of a photo: nominal focal length and sensor
  kVideo,        // telemetry beside a video
  kDefault,      // nothing is known but the size of the images
};

// "calibration", "XMP", "EXIF", "video", "default"
const char* ToString(CameraPriorSource source);

// What is known of a camera before its images are looked at: a camera and the standard deviation of
// each of its parameters, independent of each other.
struct CameraPrior {
  CameraModel camera;
  double focal_sigma = 0;               // of fx, relative
  double aspect_sigma = 0;              // of fy / fx; 0: the ratio is held
  double principal_point_sigma_px = 0;  // of cx and of cy
  // Of the coefficients, in the order of CameraModel::distortion; 0: held.
  std::array<double, 5> distortion_sigma = {0, 0, 0, 0, 0};
  double readout_sigma_s = 0;  // of the shutter's readout time; 0: it is held
  CameraPriorSource source = CameraPriorSource::kDefault;
  std::string description;  // for people: "DJI FC300S, 20 mm (35 mm equivalent)"

  // The prior of the images resized to the new size.
  CameraPrior Resized(int new_width, int new_height) const;
};

// Throws Error unless the camera is valid and no standard deviation is negative or not finite.
// `where` names the origin in the message.
void Validate(const CameraPrior& prior, const std::string& where);

// Of a camera of which only the size of the images is known, and what lens it has. Throws Error
// unless the size is positive.
CameraPrior DefaultCameraPrior(int width, int height, LensModel lens = LensModel::kBrown);

// Of a calibration that somebody measured: what such a one is trusted to. Throws Error when the
// camera is invalid.
CameraPrior CalibratedCameraPrior(const CameraModel& camera);

}  // namespace mono3d
