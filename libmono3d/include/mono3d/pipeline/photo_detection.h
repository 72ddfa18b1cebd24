// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "mono3d/core/export.h"
#include "mono3d/io/frame_source.h"

namespace MONO3D_EXPORT mono3d {

// Opens two neighbouring images, from the image `start` on.
using PairOpener = std::function<std::unique_ptr<FrameSource>(int start)>;

// Are the images photographs that no tracker can follow from one to the next? Looks at ten pairs of
// neighbours, spread over all: most of them have little in common (ContinuityOf below 0.25). False
// where the images cannot be read or show too little, and of fewer than three or more than 400.
bool ArePhotos(std::int64_t num_images, const PairOpener& open);

}  // namespace mono3d
