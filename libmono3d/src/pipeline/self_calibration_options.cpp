// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/options.h"
#include "mono3d/pipeline/self_calibrating_pipeline.h"

namespace mono3d {

void SelfCalibrationOptions::Visit(OptionVisitor& visit) {
  visit("first_frames", first_frames,
        "tracked frames after which the camera is first learned; then after twice as many");
  visit("max_buffer_mb", max_buffer_mb,
        "images kept since the first one, to be tracked again with a learned camera");
}

void SelfCalibrationOptions::Validate() const {
  calibration.Validate();
  RequireOption(first_frames >= 3, "first_frames", "3 or more", first_frames);
  RequireOption(max_buffer_mb > 0, "max_buffer_mb", "more than 0", max_buffer_mb);
}

}  // namespace mono3d
