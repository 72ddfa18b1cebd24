// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace mono3d::tools {

// RFC 4648, section 4, with padding.
std::string ToBase64(std::span<const std::uint8_t> bytes);

}  // namespace mono3d::tools
