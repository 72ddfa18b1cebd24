// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/atomic_file.h"  // with which files are written
#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Creates the folder, with those above it, unless it exists. Throws Error (kIo) when files cannot
// be created in it.
void CreateOutputFolder(const std::filesystem::path& folder);

// Throws Error (kIo) when AtomicFile could not write this file: before the work whose result it is
// to take.
void RequireWritableFile(const std::filesystem::path& file);

}  // namespace mono3d
