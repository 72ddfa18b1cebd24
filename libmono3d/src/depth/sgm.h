// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "gpu/buffer.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// What semi-global matching of the coarsest level and of the finer ones have in common.

inline constexpr std::uint32_t kNumPaths = 8;
inline constexpr std::uint32_t kFewPaths = 4;  // along rows and columns

// Steps of the paths, x and y. Opposite directions in turn, so that each half of the sums is still
// in the cache where it can be; the first kFewPaths run along rows and columns.
inline constexpr std::array<std::array<int, 2>, kNumPaths> kPathDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}}};

// P2 for each absolute difference of the grey values of neighbours.
std::array<std::uint32_t, 256> JumpPenalties(const SgmOptions& options);

// The penalties as the kernels read them.
struct SgmPenalties {
  std::uint32_t p1 = 0;
  Buffer p2;  // JumpPenalties
  // What they are made of.
  std::uint32_t min_p2 = 0;
  float p2_times_gradient = 0;
  float gradient = 0;
};

SgmPenalties UploadPenalties(std::shared_ptr<Device> device, const SgmOptions& options);

}  // namespace mono3d
