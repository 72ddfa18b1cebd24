// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "io/image_source.h"

namespace mono3d {

// Of the images of `source`, those that the motion of the camera calls for: the first, then each
// that has moved by a two-hundredth of the image's longer side against the one taken before, or of
// which that cannot be told. After at most four times as many images as the time before one is
// taken in any case, so that times between images change gradually, as who predicts the motion
// expects. What is taken depends on the images up to there alone, not on their rate or time stamps.
// At most `max_frames` (0: all). num_frames() is an upper bound.
std::unique_ptr<ImageSource> StrideByMotion(std::unique_ptr<ImageSource> source, int max_frames);

}  // namespace mono3d
