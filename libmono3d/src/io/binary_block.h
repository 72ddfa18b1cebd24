// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <bit>
#include <cstddef>
#include <string>

#include "mono3d/io/output_file.h"

namespace mono3d {

static_assert(std::endian::native == std::endian::little, "values are written as they are");

// Appends `count` values to a block of a binary little-endian file.
template <typename T>
void AppendBytes(std::string& block, const T* values, std::size_t count) {
  block.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

// Writes and empties a block of 1 MiB and more: the system is asked once per block.
inline void WriteWhenFull(AtomicFile& file, std::string& block) {
  if (block.size() < (std::size_t{1} << 20)) return;
  file.Write(block);
  block.clear();
}

}  // namespace mono3d
