// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d {

// What views say of the same place.
struct ColourSample {
  std::size_t place = 0;
  std::size_t view = 0;
  cv::Vec3f colour;  // 0 to 255
};

// A factor for each of the three colours of each view, so that views agree where they show the
// same: least squares of the logarithms, robust against what moves or glitters; their mean is
// near 1. `samples` are sorted by place. Views without samples have 1.
std::vector<cv::Vec3f> BalanceViews(const std::vector<ColourSample>& samples,
                                    std::size_t num_views);

}  // namespace mono3d
