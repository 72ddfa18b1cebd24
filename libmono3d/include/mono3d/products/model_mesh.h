// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>

#include "mono3d/core/export.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

struct ModelMeshOptions {
  std::size_t max_triangles = 300'000;
  // A model of more is meshed in parts, with so many each; they take about half a gigabyte.
  std::size_t max_surfels_of_part = 1'000'000;
  MeshOptions mesh = {};
};

struct ModelMesh {
  TriangleMesh mesh;              // at most max_triangles
  std::size_t num_triangles = 0;  // that there were before decimation
  std::size_t num_parts = 0;
  double error_su = 0;          // how far decimation moved the surface, at most
  double median_radius_su = 0;  // of the surfels
};

// The mesh of model.ply, decimated. Of a model in parts, each is decimated to four times its share
// with its borders as they are, and all together to the rest: between parts there is neither a seam
// nor a triangle twice, and memory holds one part and some times `max_triangles`, however large the
// model. Throws Error where the file cannot be read or is no model of surfels.
ModelMesh MakeModelMesh(const std::filesystem::path& model, const ModelMeshOptions& options = {});

}  // namespace mono3d
