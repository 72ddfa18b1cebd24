// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string_view>

namespace mono3d::tools {

// three.module.min.js: three.js as one module without imports.
std::string_view ThreeModule();

}  // namespace mono3d::tools
