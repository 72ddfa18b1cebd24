// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// How the folder of a run begins that is not whole yet, or never was: a number follows.
inline constexpr const char* kUnfinishedStem = "unfinished_";

// Are there files in the folder that a RunWriter would clear? Throws Error (kIo) where it cannot be
// read.
bool HoldsRun(const std::filesystem::path& folder);

// Puts what is in `made` in place of the run in `folder`, on the same file system: moves the files
// of the earlier run out of it, all of `made` into it, and removes `made` with the earlier run.
// Files that no run writes stay. Throws Error (kIo) where the system refuses; both are as they were
// then.
void ReplaceRun(const std::filesystem::path& folder, const std::filesystem::path& made);

// Ends each ReplaceRun that a killed process began there, from a folder kUnfinishedStem + number:
// the new run takes its place where all of the earlier one had been moved, else that one is moved
// back. Throws Error (kIo) where the system refuses.
void EndReplacements(const std::filesystem::path& folder);

}  // namespace mono3d
