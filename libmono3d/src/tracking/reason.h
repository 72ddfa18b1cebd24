// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

namespace mono3d::tracking {

// "62 matches, 100 needed".
inline std::string NeededText(int found, const char* what, int needed) {
  return std::to_string(found) + " " + what + ", " + std::to_string(needed) + " needed";
}

}  // namespace mono3d::tracking
