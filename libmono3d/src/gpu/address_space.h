// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <string>

namespace mono3d {

// What a driver may take at once: that which compiles a shader for the CPU takes some 100 MB, and
// ends the process where it does not get them.
inline constexpr std::size_t kOpeningBytes = std::size_t{600} << 20;
inline constexpr std::size_t kDriverCallBytes = std::size_t{256} << 20;

// Throws Error (kOutOfMemory) where the memory of the process is limited (ulimit -v) and so much
// cannot be had. `where` names the device or the kernel. Any thread.
void RequireAddressSpace(const std::string& where, std::size_t num_bytes);

}  // namespace mono3d
