// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/mesh_part.h"

#include <cmath>

#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_transform.h"
#include "mono3d/io/mesh_file.h"

namespace mono3d::tools {
namespace {

constexpr std::uint32_t kSeed = 1;
constexpr std::size_t kOnePercent = 1;  // of CloudThresholds

std::vector<std::string> ErrorRow(const std::string& name, const CloudError& error,
                                  const std::optional<SurfaceEvaluation>& surface,
                                  std::optional<double> mean_depth_m) {
  const CloudError& used = surface ? surface->error : error;
  std::vector<std::string> row = {name, FormatLength(used.estimate_to_truth.rmse, mean_depth_m),
                                  FormatLength(used.estimate_to_truth_plane.rmse, mean_depth_m)};
  if (error.shares.size() > kOnePercent) {
    const CloudShares& shares =
        surface ? surface->seen.at(kOnePercent) : error.shares.at(kOnePercent);
    for (const double share : {shares.accuracy, shares.completeness, shares.f_score}) {
      row.push_back(FormatPercent(share, 2));
    }
  }
  return row;
}

void SetAccuracy(double accuracy, CloudShares& shares) {
  shares.accuracy = accuracy;
  const double sum = accuracy + shares.completeness;
  shares.f_score = sum > 0 ? 2 * accuracy * shares.completeness / sum : 0;
}

// The same distances, each of which counts as much as the area of its surfel; only what ErrorRow
// states is changed.
CloudError ByArea(const CloudError& error, const PointCloud& surfels) {
  CloudError weighted = error;
  double sum = 0;
  double squares = 0;
  double squares_to_planes = 0;
  std::vector<double> within(error.shares.size(), 0);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const double area = double{surfels.radii[i]} * double{surfels.radii[i]};
    const double distance_m = error.estimate_distances_m[i];
    const double plane_distance_m = error.estimate_plane_distances_m[i];
    sum += area;
    squares += area * distance_m * distance_m;
    squares_to_planes += area * plane_distance_m * plane_distance_m;
    for (std::size_t k = 0; k < within.size(); ++k) {
      within[k] += distance_m <= error.shares[k].threshold_m ? area : 0;
    }
  }
  weighted.estimate_to_truth.rmse = std::sqrt(squares / sum);
  weighted.estimate_to_truth_plane.rmse = std::sqrt(squares_to_planes / sum);
  for (std::size_t k = 0; k < within.size(); ++k) SetAccuracy(within[k] / sum, weighted.shares[k]);
  return weighted;
}

std::optional<SurfaceEvaluation> ByArea(const std::optional<SurfaceEvaluation>& surface,
                                        const PointCloud& surfels) {
  if (!surface) return std::nullopt;
  SurfaceEvaluation weighted;
  weighted.error = ByArea(surface->error, surfels);
  weighted.seen = surface->seen;
  for (std::size_t k = 0; k < weighted.seen.size(); ++k) {
    SetAccuracy(weighted.error.shares[k].accuracy, weighted.seen[k]);
  }
  return weighted;
}

Table TopologyTable(const MeshEvaluation& mesh) {
  const MeshTopology& topology = mesh.topology;
  const auto share = [](std::size_t part, std::size_t all) {
    return FormatPercent(all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0, 2);
  };
  Table table;
  table.title = "Mesh: how it hangs together and holds to the surfels";
  table.columns = {"what", "figure"};
  table.rows = {
      {"triangles", std::to_string(mesh.num_triangles)},
      {"vertices", std::to_string(mesh.num_vertices)},
      {"connected pieces", std::to_string(topology.num_pieces)},
      {"triangles in the largest piece",
       share(topology.num_triangles_of_largest, mesh.num_triangles)},
      {"edges of one triangle (borders, holes)",
       share(topology.num_open_edges, topology.num_edges)},
      {"edges of more than two triangles", std::to_string(topology.num_crowded_edges)},
      {"triangles without an area", std::to_string(topology.num_flat_triangles)},
      {"vertices of no triangle", std::to_string(topology.num_unused_vertices)},
      {"area without a surfel near it", FormatPercent(mesh.fit.unsupported_share, 3)},
      {"largest gap to a surfel, in its radii", FormatNumber(mesh.fit.largest_gap_radii, 3)},
      {"surfels without mesh near them", FormatPercent(mesh.fit.missed_share, 3)}};
  table.notes = {"Near: within " + FormatNumber(kSupportRadii, 2) + " radii of the surfel."};
  return table;
}

}  // namespace

MeshEvaluation EvaluateMesh(const std::filesystem::path& path, const PointCloud& surfels_in_truth,
                            const Similarity& S_truth_estimate, const PointCloud& truth,
                            std::span<const double> thresholds_m) {
  TriangleMesh mesh = ReadMeshPly(path);
  PointCloud vertices;
  vertices.points = std::move(mesh.vertices);
  mesh.vertices = TransformCloud(S_truth_estimate, vertices).points;
  try {
    MeshEvaluation evaluation;
    evaluation.num_vertices = mesh.vertices.size();
    evaluation.num_triangles = mesh.triangles.size();
    evaluation.area_m2 = ComputeArea(mesh);
    evaluation.topology = ComputeTopology(mesh);
    evaluation.samples_in_truth = SampleMesh(mesh, surfels_in_truth.size(), kSeed);
    evaluation.fit = FitOfMesh(mesh, evaluation.samples_in_truth, surfels_in_truth);
    evaluation.error = ComputeCloudError(evaluation.samples_in_truth, truth, thresholds_m);
    return evaluation;
  } catch (const Error& error) {
    throw Error(
        ErrorParts{.what = error.what(), .where = path.string(), .expected = {}, .found = {}});
  }
}

Json ToJson(const MeshEvaluation& mesh) {
  const MeshTopology& topology = mesh.topology;
  Json json = {{"vertices", mesh.num_vertices},
               {"triangles", mesh.num_triangles},
               {"area_m2", mesh.area_m2},
               {"pieces", topology.num_pieces},
               {"triangles_of_largest_piece", topology.num_triangles_of_largest},
               {"edges", topology.num_edges},
               {"open_edges", topology.num_open_edges},
               {"crowded_edges", topology.num_crowded_edges},
               {"flat_triangles", topology.num_flat_triangles},
               {"unused_vertices", topology.num_unused_vertices},
               {"support_radii", kSupportRadii},
               {"unsupported_share", mesh.fit.unsupported_share},
               {"largest_gap_radii", mesh.fit.largest_gap_radii},
               {"missed_surfel_share", mesh.fit.missed_share},
               {"samples", mesh.samples_in_truth.size()}};
  json["error"] = ToJson(mesh.error);
  if (mesh.surface) json["whole_surface"] = ToJson(*mesh.surface);
  return json;
}

std::vector<Table> MeshTables(const MeshEvaluation& mesh, const MeshedModel& model,
                              std::optional<double> mean_depth_m) {
  const bool is_seen = model.surface && mesh.surface;
  const std::optional<SurfaceEvaluation> none;
  const std::optional<SurfaceEvaluation>& surface = is_seen ? model.surface : none;
  Table table;
  table.title = "Mesh: distances to the truth beside those of the surfels";
  table.columns = {"of", "RMSE to points", "RMSE to planes"};
  if (mesh.error.shares.size() > kOnePercent) {
    table.columns.insert(table.columns.end(),
                         {"accuracy at 1 %", "completeness at 1 %", "F-score at 1 %"});
  }
  table.rows = {ErrorRow("surfels", model.error, surface, mean_depth_m),
                ErrorRow("surfels, by area", ByArea(model.error, model.surfels),
                         ByArea(surface, model.surfels), mean_depth_m),
                ErrorRow("mesh", mesh.error, is_seen ? mesh.surface : none, mean_depth_m)};
  table.notes = {
      "Of " + std::to_string(mesh.samples_in_truth.size()) +
          " points on the mesh, spread evenly by area. Surfels are denser where the camera "
          "was near; by area each counts as the square of its radius.",
      is_seen ? "Against all of the true surface that the frames show."
              : "Against the true cloud."};
  return {table, TopologyTable(mesh)};
}

}  // namespace mono3d::tools
