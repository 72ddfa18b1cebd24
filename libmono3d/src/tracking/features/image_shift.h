// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// By how many pixels most of what both views show has moved from `a` to `b`, however far: the shift
// that the most similar features vote for (generalised Hough transform: Ballard 1981), the mean
// over an eighth of the image width around the peak. Between few images a second the image moves
// by far more than a search window, but all over by much the same. Only features of `a` for which
// `use_a` holds, of levels up to `max_level`. Nothing where no shift stands out beyond chance, as
// after a turn about the line of sight or between pictures of different places.
std::optional<Eigen::Vector2d> CommonShift(const View& a, const std::vector<char>& use_a,
                                           const View& b, int max_level);

}  // namespace mono3d::tracking
