// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Version of the library that is linked, "major.minor.patch".
const char* Version();

}  // namespace mono3d
