// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d::reference {

// Sums over eight paths (Hirschmueller 2008, eq. 13 and 14). `costs` and the result hold
// `num_planes` values for each pixel of `grey`; `jump_penalties` P2 by difference of grey values.
std::vector<std::uint16_t> AggregateCosts(const std::vector<std::uint8_t>& costs,
                                          const cv::Mat& grey, int num_planes, int p1,
                                          const std::array<std::uint32_t, 256>& jump_penalties);

}  // namespace mono3d::reference
