// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mono3d {

// Indices of at most `max_points` points, spread evenly in space: the first of each voxel, whose
// size is found so that seven tenths of `max_points` or more remain where points differ. All
// points, in their order, when there are not more. Needs max_points > 0.
std::vector<std::uint32_t> SampleEvenly(std::span<const Eigen::Vector3d> points,
                                        std::size_t max_points);

}  // namespace mono3d
