// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "mono3d/geometry/stamped_pose.h"

namespace mono3d {

struct PosePair {
  std::size_t estimate_index = 0;
  std::size_t truth_index = 0;
};

// Pairs by time, in order of the true times; the rule is at CompareTrajectories.
std::vector<PosePair> AssociateByTime(std::span<const StampedPose> estimate,
                                      std::span<const StampedPose> truth,
                                      double max_time_difference_s);

}  // namespace mono3d
