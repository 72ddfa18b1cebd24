// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>

#include "evaluate/evaluation.h"
#include "evaluate/surface_part.h"
#include "mono3d/evaluation/mesh_fit.h"
#include "mono3d/geometry/mesh_measures.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace mono3d::tools {

// A mesh against the true surface and against the surfels that it was made of.
struct MeshEvaluation {
  std::size_t num_vertices = 0;
  std::size_t num_triangles = 0;
  double area_m2 = 0;
  MeshTopology topology;
  MeshFit fit;
  PointCloud samples_in_truth;               // as many points, even by area, as there are surfels
  CloudError error;                          // theirs, against the true cloud
  std::optional<SurfaceEvaluation> surface;  // where more is known than the true cloud
};

// Reads the mesh of the same frame as `surfels`, as which the model was registered to the truth by
// `S_truth_estimate`. Throws Error; what() names the file.
MeshEvaluation EvaluateMesh(const std::filesystem::path& mesh, const PointCloud& surfels_in_truth,
                            const Similarity& S_truth_estimate, const PointCloud& truth,
                            std::span<const double> thresholds_m);

Json ToJson(const MeshEvaluation& mesh);

// The model that a mesh was made of.
struct MeshedModel {
  const PointCloud& surfels;
  const CloudError& error;
  const std::optional<SurfaceEvaluation>& surface;
};

// How far mesh and model are from the truth, and how the mesh hangs together.
std::vector<Table> MeshTables(const MeshEvaluation& mesh, const MeshedModel& model,
                              std::optional<double> mean_depth_m);

}  // namespace mono3d::tools
