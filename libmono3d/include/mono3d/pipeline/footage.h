// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "mono3d/core/export.h"
#include "mono3d/io/frame_source.h"

namespace MONO3D_EXPORT mono3d {

// More are not placed together: the time grows with the square of their number.
inline constexpr std::int64_t kMostImagesPlacedTogether = 400;

// Opens two neighbouring images, from the image `start` on.
using PairOpener = std::function<std::unique_ptr<FrameSource>(int start)>;

// How images go on from one to the next.
enum class Footage {
  kVideo,        // each can be followed from the one before
  kSparseVideo,  // in the order of time, but neighbours share less than 70 % of what they show
  kPhotographs,  // in any order
};

// By ten pairs of neighbours, spread over all, and what most of them have in common: ContinuityOf
// below 0.38 of photographs, below 0.7 of a sparse video. kVideo where the images cannot be read or
// show too little, and of fewer than three or more than kMostImagesPlacedTogether.
Footage JudgeFootage(std::int64_t num_images, const PairOpener& open);

}  // namespace mono3d
