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

// What the images themselves say about why they do not match: that the reference, or all others,
// show nothing but one grey value around nearly every pixel. Empty when they show something.
std::optional<std::string> ReasonInTheImages(const ImageBundle& bundle);

}  // namespace mono3d
