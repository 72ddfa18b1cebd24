// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <memory>

#include "mono3d/core/export.h"
#include "mono3d/io/frame_source.h"

namespace MONO3D_EXPORT mono3d {

// Opens two neighbouring images, from the image `start` on.
using PairOpener = std::function<std::unique_ptr<FrameSource>(int start)>;

// Are the images photographs and no video? Looks at ten pairs of neighbours, spread over all: half
// of them and more do not go on from one image to the next (ContinuityOf below 0.45). False
// where the images cannot be read, and of fewer than three.
bool ArePhotos(std::int64_t num_images, const PairOpener& open);

}  // namespace mono3d
