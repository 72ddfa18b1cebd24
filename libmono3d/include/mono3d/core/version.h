// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d {

// Version of the library that is linked, "major.minor.patch".
const char* Version();

}  // namespace mono3d
