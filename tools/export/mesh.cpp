// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "export/mesh.h"

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/triangle_mesh.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/ply_reader.h"
#include "mono3d/products/mesh_decimation.h"
#include "mono3d/products/mesh_texturing.h"
#include "mono3d/products/model_mesh.h"
#include "mono3d/products/run_image.h"
#include "mono3d/products/textured_mesh_file.h"

namespace mono3d::tools {
namespace {

struct MeshProductOptions {
  int triangles = 300000;
  TexturingOptions texturing;
};

// Of the command line, or as they are from the start.
MeshProductOptions& OptionsOfMesh() {
  static MeshProductOptions options;
  return options;
}

void AddMeshOptions(CLI::App& app) {
  MeshProductOptions& options = OptionsOfMesh();
  app.add_option("--triangles", options.triangles, "mesh: at most so many triangles")
      ->capture_default_str();
  app.add_option("--texture-side", options.texturing.texture_side_px,
                 "mesh: px of a texture at most; 4096 is shown everywhere")
      ->capture_default_str();
  app.add_option("--textures", options.texturing.max_textures,
                 "mesh: at most so many textures; images are scaled down to fit")
      ->capture_default_str();
  app.add_option("--blend", options.texturing.num_blended,
                 "mesh: images whose mean each place shows; 1: the best one")
      ->capture_default_str();
}

std::vector<TextureView> ViewsOf(const FinishedRun& run) {
  std::vector<TextureView> views;
  for (const RunImage& image : ImagesThatAreThere(run, "the mesh")) {
    views.push_back({.read = [image] { return ReadRunImage(image); },
                     .camera = image.camera,
                     .T_world_cam = image.T_world_cam});
  }
  return views;
}

double MedianRadius(const std::filesystem::path& model) {
  PlyReader reader(model);
  std::vector<float> radii;
  PointCloud block;
  constexpr std::size_t kSurfelsOfBlock = std::size_t{1} << 16;
  while (reader.Read(kSurfelsOfBlock, block) > 0) {
    radii.insert(radii.end(), block.radii.begin(), block.radii.end());
  }
  if (radii.empty()) {
    throw Error(ErrorParts{"the model has no surfels", model.string(), "radii", "none"});
  }
  return UpperMedian(std::move(radii));
}

// The mesh that the run has written, or else that of its model.
ModelMesh MeshOf(const FinishedRun& run, std::size_t max_triangles) {
  if (run.mesh.empty()) return MakeModelMesh(run.model, {.max_triangles = max_triangles});
  ModelMesh of_run;
  const TriangleMesh whole = ReadMeshPly(run.mesh);
  DecimatedMesh decimated = Decimate(whole, max_triangles);
  of_run.mesh = std::move(decimated.mesh);
  of_run.num_triangles = whole.triangles.size();
  of_run.num_parts = 1;
  of_run.error_su = decimated.error_su;
  of_run.median_radius_su = MedianRadius(run.model);
  return of_run;
}

std::vector<std::filesystem::path> WriteMesh(const FinishedRun& run,
                                             const std::filesystem::path& folder) {
  const MeshProductOptions& options = OptionsOfMesh();
  RequireOption(options.triangles >= 1, "triangles", "1 or more", options.triangles);
  options.texturing.Validate();
  const std::vector<TextureView> views = ViewsOf(run);
  const ModelMesh decimated = MeshOf(run, static_cast<std::size_t>(options.triangles));
  const double radius_su = decimated.median_radius_su;
  if (decimated.error_su > radius_su) {
    Log(LogLevel::kWarning, "--triangles " + std::to_string(options.triangles) +
                                " moves the surface by up to " +
                                std::to_string(decimated.error_su / radius_su) +
                                " radii of a surfel; more triangles keep it");
  }
  const TexturingResult textured = TextureMesh(decimated.mesh, views, radius_su, options.texturing);
  std::printf(
      "mesh: %zu of %zu triangles, %zu textures, %zu pieces of %zu images, %.1f %% unseen\n",
      decimated.mesh.triangles.size(), decimated.num_triangles, textured.mesh.textures.size(),
      textured.num_charts, textured.num_views,
      100.0 * static_cast<double>(textured.num_unseen) /
          static_cast<double>(decimated.mesh.triangles.size()));
  if (textured.texels_per_pixel < 1) {
    Log(LogLevel::kWarning, "the textures hold the images at " +
                                std::to_string(textured.texels_per_pixel) +
                                " of their size; more with --textures or --texture-side");
  }
  const MeshFileOptions of_files{.origin = run.origin};
  WriteGlb(folder / "mesh.glb", textured.mesh, of_files);
  std::vector<std::filesystem::path> written = {folder / "mesh.glb"};
  const auto obj = WriteObj(folder / "mesh.obj", textured.mesh, of_files);
  written.insert(written.end(), obj.begin(), obj.end());
  return written;
}

}  // namespace

Product MeshProduct() {
  return {"mesh", "mesh.glb and mesh.obj, triangles textured from the images", AddMeshOptions,
          WriteMesh};
}

}  // namespace mono3d::tools
