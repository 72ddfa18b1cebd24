// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <numbers>

namespace mono3d {

inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace mono3d
