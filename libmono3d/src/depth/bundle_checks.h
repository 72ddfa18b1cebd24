// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>

#include "gpu/device_handle.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// Throws Error, with what is expected and what was found, on an invalid bundle, on images smaller
// than kMinDepthSide, and on those too large for the buffers of the device.
void RequireBundle(const ImageBundle& bundle, const Device& device);

// Are there as many matching images as a point must be seen by?
bool HasEnoughViews(const ImageBundle& bundle, const RefinementOptions& refinement);

// Why these images cannot be matched, where they show it themselves: around nearly every pixel the
// reference, or every other image, has only one grey value. Empty when they have texture.
std::optional<std::string> ReasonInTheImages(const ImageBundle& bundle);

}  // namespace mono3d
