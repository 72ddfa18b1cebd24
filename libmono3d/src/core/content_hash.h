// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace mono3d {

// 128 bits of which every one depends on every byte, so many that different bytes never have the
// same by chance. It detects damage, and is no protection against forgery. Gigabytes a second.
std::array<std::uint64_t, 2> ContentHash(std::string_view bytes);

}  // namespace mono3d
