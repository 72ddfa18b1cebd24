// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Are there files in the folder that a RunWriter would clear?
bool HoldsRun(const std::filesystem::path& folder);

// Puts what is in `made` in place of the run in `folder`, on the same file system: removes the
// files of the earlier run, moves all of `made` there and removes `made`. Files that no run writes
// stay. Throws Error (kIo) where the system refuses; nothing of `made` is lost then.
void ReplaceRun(const std::filesystem::path& folder, const std::filesystem::path& made);

}  // namespace mono3d
