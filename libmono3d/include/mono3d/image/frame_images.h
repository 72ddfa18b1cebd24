// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// What the state of a run has of the images that are still needed.
enum class SavedImages {
  kIncluded,  // themselves, without loss: of a camera that cannot be asked for them again
  kByIndex,   // the indices of their frames: whoever restores the state reads them again
};

// The image of the frame of that index, to the bit as it was given before: CV_8UC3.
using ImageOfFrame = std::function<cv::Mat(std::int64_t frame_index)>;

}  // namespace mono3d
