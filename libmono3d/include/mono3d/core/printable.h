// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <string_view>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// The text as one line that does nothing to a terminal: line ends and tabs become blanks, other
// control characters "\x1b". What an Error says is such a line.
std::string Printable(std::string_view text);

}  // namespace mono3d
