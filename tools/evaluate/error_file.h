// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <span>

#include "mono3d/geometry/point_cloud.h"

namespace mono3d::tools {

// Beside model.ply of a run.
inline constexpr const char* kErrorFileName = "model_errors.ply";

// How far each point of a model is from the truth: a binary PLY file with the points of the model,
// in its order and its axes, and their distance in metres as `error`. For mono3d-view, and for
// programs that show a scalar field. Throws Error when it cannot be written.
void WriteErrorFile(const std::filesystem::path& path, const PointCloud& model,
                    std::span<const double> distances_m);

}  // namespace mono3d::tools
