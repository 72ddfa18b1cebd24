// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "common/camera_choice.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/footage.h"

namespace mono3d::tools {

// Of the images of `input`, to look at them as they are: no distortion and no shutter.
CameraModel CameraAsTaken(const std::string& input, const CameraArguments& camera);

// How the images of `input` go on from one to the next; a video file is a video. Says on stdout
// where it is anything else.
Footage FootageOf(const std::string& input, const CameraArguments& camera,
                  const FrameSourceOptions& source);

}  // namespace mono3d::tools
