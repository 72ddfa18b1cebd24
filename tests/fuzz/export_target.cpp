// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "io/image_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/products/dense_workspace.h"
#include "mono3d/products/las_file.h"
#include "mono3d/products/map_axes.h"
#include "mono3d/products/mesh_decimation.h"
#include "mono3d/products/mesh_texturing.h"
#include "mono3d/products/nerfstudio_file.h"
#include "mono3d/products/orthophoto.h"
#include "mono3d/products/raster_file.h"
#include "mono3d/products/run_image.h"
#include "mono3d/products/splat_file.h"
#include "mono3d/products/surface_model.h"
#include "mono3d/products/textured_mesh_file.h"

namespace mono3d::fuzz {
namespace {

namespace fs = std::filesystem;

// The files of a run in the order in which an input has them; those that are empty are not there.
constexpr std::array<const char*, 9> kFiles = {"run.json",
                                               "sparse/cameras.txt",
                                               "sparse/images.txt",
                                               "sparse/points3D.txt",
                                               "depth/camera.yaml",
                                               "model_trajectory.txt",
                                               "model.ply",
                                               "mesh.ply",
                                               "depth/000000.depth.pfm"};

void WriteFiles(std::string_view input, const InputFolder& folder) {
  constexpr std::string_view kSeparator = "\n======\n";
  for (const char* name : kFiles) {
    const std::size_t end = std::min(input.find(kSeparator), input.size());
    const fs::path file = folder.Write(std::string("run/") + name, input.substr(0, end));
    if (end == 0) fs::remove(file);
    input.remove_prefix(std::min(end + kSeparator.size(), input.size()));
  }
}

// What a product refuses is an Error; others are made all the same.
template <typename Make>
void MakeOrRefuse(Make&& make) {
  static_cast<void>(ReadOrRefuse([&] {
    make();
    return true;
  }));
}

void WriteRasters(const FinishedRun& run, const MapAxes& axes, const fs::path& out) {
  constexpr double kCells = 50;  // of the longer side
  MapSurfels surfels(run.model, axes);
  const Eigen::AlignedBox2d part = surfels.BoundsOfMost();
  static_cast<void>(RoundedCell(GroundSampleDistance(run, true)));
  const RasterGrid grid = GridOver(part, std::max(1e-9, part.sizes().maxCoeff() / kCells));
  RasterFile heights(out / "dsm.tif", grid, axes, RasterForm::kHeights);
  MakeSurfaceModel(surfels, axes, grid, [&](const cv::Rect& place, const cv::Mat& cells) {
    heights.Write(place, cells);
  });
  RasterFile picture(out / "orthophoto.tif", grid, axes, RasterForm::kPicture);
  static_cast<void>(MakeOrthophoto(
      run, axes, {.grid = grid, .read = [&](const cv::Rect& place) { return heights.Read(place); }},
      grid, [&](const cv::Rect& place, const cv::Mat& cells) { picture.Write(place, cells); }));
}

void WriteTexturedMesh(const FinishedRun& run, const fs::path& out) {
  constexpr std::size_t kMaxTriangles = 200;
  const PointCloud cloud = ReadPly(run.model);
  const TriangleMesh whole = run.mesh.empty() ? MeshSurfels(cloud) : ReadMeshPly(run.mesh);
  const DecimatedMesh decimated = Decimate(whole, kMaxTriangles);
  std::vector<TextureView> views;
  for (const RunImage& image : ImagesThatAreThere(run, "the mesh")) {
    views.push_back({[image] { return ReadRunImage(image); }, image.camera, image.T_world_cam});
  }
  const double radius_su = cloud.radii.empty() ? 0.1 : cloud.radii.front();
  const TexturingResult textured =
      TextureMesh(decimated.mesh, views, radius_su, {.texture_side_px = 64, .max_textures = 2});
  WriteGlb(out / "mesh.glb", textured.mesh, {.origin = run.origin});
  static_cast<void>(WriteObj(out / "mesh.obj", textured.mesh));
}

}  // namespace

// A run of somebody else: nothing of it may lead out of the folder of its products.
void Export(std::string_view input) {
  static const InputFolder folder("export");
  static const fs::path image = [] {
    cv::Mat bgr(24, 32, CV_8UC3);
    cv::randu(bgr, 0, 255);
    fs::create_directories(folder.path() / "run/images");
    WritePng(folder.path() / "run/images/000000.png", bgr);
    return folder.path() / "run/images/000000.png";
  }();
  WriteFiles(input, folder);
  const fs::path out = folder.path() / "out" / "products";
  fs::remove_all(folder.path() / "out");
  fs::create_directories(out);
  const auto run = ReadOrRefuse([&] { return ReadFinishedRun(folder.path() / "run"); });
  if (!run) return;
  MakeOrRefuse([&] { WriteSplats(out / "splats.ply", ReadPly(run->model)); });
  MakeOrRefuse([&] { static_cast<void>(WriteNerfstudio(out / "nerfstudio", *run)); });
  MakeOrRefuse([&] { static_cast<void>(WriteDepthTiffs(out / "depth", *run)); });
  MakeOrRefuse([&] { static_cast<void>(WriteDenseWorkspace(out / "dense", *run)); });
  MakeOrRefuse([&] { WriteTexturedMesh(*run, out); });
  const auto axes = ReadOrRefuse([&] { return AxesOfProducts(*run, ""); });
  if (axes) {
    MakeOrRefuse([&] {
      MapSurfels surfels(run->model, *axes);
      WriteLas(out / "model.las", surfels, *axes);
      WriteLocalPly(out / "model_local.ply", surfels, *axes);
    });
    MakeOrRefuse([&] { WriteRasters(*run, *axes, out); });
  }
  for (const auto& entry : fs::directory_iterator(folder.path() / "out")) {
    if (entry.path() != out) throw std::logic_error("a file outside the folder of the products");
  }
}

}  // namespace mono3d::fuzz
