// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/timing.h"

namespace mono3d {

// Of a clock that never goes back.
inline double Clock_s() { return 1e-3 * WallClockMs(); }

}  // namespace mono3d
