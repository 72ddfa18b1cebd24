// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace mono3d {

// All throw Error (kIo) that names the file and what the system says.

// With those above it; nothing where it is there.
void CreateFolder(const std::filesystem::path& path);

// Names in a folder are on the disk when the folder is. Where the file system cannot promise it
// (EINVAL), the names are there all the same.
void SynchroniseFolder(const std::filesystem::path& folder);

// `size` bytes from `offset` on; zeros where the file ends before.
std::string ReadFileRange(const std::filesystem::path& path, std::uint64_t offset,
                          std::uint64_t size);

}  // namespace mono3d
