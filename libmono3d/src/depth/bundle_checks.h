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
// than kMinDepthSide or too large for the buffers of the device, and when there are fewer
// matching images than a point must be seen by.
void RequireBundle(const ImageBundle& bundle, const RefinementOptions& refinement,
                   const Device& device);

// Why these images cannot be matched, where they show it themselves: around nearly every pixel the
// reference, or every other image, has only one grey value. Empty when they have texture.
std::optional<std::string> ReasonInTheImages(const ImageBundle& bundle);

}  // namespace mono3d
