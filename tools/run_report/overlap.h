// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "mono3d/image/sparse_model.h"

namespace mono3d::tools {

// How a keyframe hangs together with the one before it.
struct KeyframeOverlap {
  std::int64_t frame_index = 0;
  int num_points = 0;         // that it shows
  double shared = 0;          // of them, that the one before shows as well; 0 to 1
  double baseline_ratio = 0;  // distance of the two cameras over the median depth of its points
};

// Of every keyframe but the first, in the order of the frames.
std::vector<KeyframeOverlap> Overlaps(const SparseModel& sparse);

}  // namespace mono3d::tools
