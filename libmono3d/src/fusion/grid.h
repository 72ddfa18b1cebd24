// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "gpu/kernel.h"
#include "gpu/recorder.h"

namespace mono3d {

// Devices take at least 65535 workgroups along an axis: what is more goes on along y, as
// WorkGroupIndex() of shaders/fusion/item.glsl expects.
inline std::array<std::uint32_t, 3> GroupGrid(std::uint32_t groups) {
  constexpr std::uint32_t kMaxGroupsAlongX = 32'768;
  const std::uint32_t along_x = std::min(groups, kMaxGroupsAlongX);
  return {along_x, along_x == 0 ? 0 : DivideRoundingUp(groups, along_x), 1};
}

// Workgroups for one invocation per item.
inline std::array<std::uint32_t, 3> GridFor(const Kernel& kernel, std::uint64_t items) {
  return GroupGrid(DivideRoundingUp(items, kernel.workgroup_size()[0]));
}

}  // namespace mono3d
