// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/image/sparse_model.h"

namespace mono3d {

// Writes cameras.bin, images.bin and points3D.bin, as https://colmap.github.io/format.html
// describes them, into a folder that is there. `model` is valid.
void WriteColmapBinary(const std::filesystem::path& folder, const SparseModel& model);

}  // namespace mono3d
