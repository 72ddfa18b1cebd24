// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"

namespace mono3d::calibration {

// Frames that are tracked without those before and after.
struct FootagePart {
  int start = 0;
  int num_frames = 0;  // 0: to the end
  bool operator==(const FootagePart&) const = default;
};

// What to look at: the parts, then longer ones where those tell too little. Empty: none.
struct FootageParts {
  std::vector<FootagePart> all;
  std::vector<FootagePart> longer = {};
  bool is_matched_once = false;  // photographs: each round has the same features
};

// Spread evenly over footage of so many frames; of one of which the number is not known, its first.
FootageParts ChooseParts(std::optional<std::int64_t> num_frames, const CalibrationOptions& options);

}  // namespace mono3d::calibration
