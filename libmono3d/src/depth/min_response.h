// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "image/image_noise.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// The mean DoG response above which a window has texture: options.min_response for images with a
// noise of one grey level or less, and in proportion to the noise between one and five grey levels.
double MinResponse(const DogOptions& options, const ImageNoise& noise);

}  // namespace mono3d
