// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/version.h"

namespace mono3d {

const char* Version() { return MONO3D_VERSION; }

}  // namespace mono3d
