// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace mono3d {

// The pixels whose bit is set in a mask of 32 pixels a word, in their order: each has its place
// among the new surfels, so that the same input gives the same model whatever order the device
// works in.
std::vector<std::uint32_t> ListSelected(std::span<const std::uint32_t> mask);

}  // namespace mono3d
