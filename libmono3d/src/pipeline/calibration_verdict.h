// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/calibration/camera_calibration.h"

namespace mono3d {

enum class CalibrationVerdict {
  kBetter,     // another camera than the prior's is proven
  kAgrees,     // the images know the camera, and it is the prior's
  kUndecided,  // more images may tell
};

// Proven is a camera that shows a ray elsewhere than the prior's by more than three standard
// deviations and 0.3 px in 1,000, or whose readout time differs by more than three and 1 ms. While
// more images are to come, it must be known to half a percent of the image's larger side as well,
// so that it is worth to be adopted once.
CalibrationVerdict Judge(const CameraCalibration& calibration, bool is_last_chance);

}  // namespace mono3d
