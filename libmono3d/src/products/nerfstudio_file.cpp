// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/nerfstudio_file.h"

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "mono3d/image/undistorter.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/products/run_image.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json ParametersOf(const CameraModel& camera) {
  const bool is_fisheye = camera.lens == LensModel::kFisheye;
  nlohmann::ordered_json parameters = {{"camera_model", is_fisheye ? "OPENCV_FISHEYE" : "OPENCV"},
                                       {"w", camera.width},
                                       {"h", camera.height},
                                       {"fl_x", camera.fx},
                                       {"fl_y", camera.fy},
                                       {"cx", camera.cx + .5},
                                       {"cy", camera.cy + .5}};
  // A pinhole lens has k1 k2 p1 p2 k3, a fisheye lens k1 k2 k3 k4.
  const std::vector<std::string> names = DistortionNames(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    parameters[names[i]] = camera.distortion.at(i);
  }
  return parameters;
}

// Camera to world, the camera's axes those of OpenGL: x right, y up, z backwards.
nlohmann::ordered_json TransformOf(const Pose& T_world_cam) {
  Eigen::Matrix4d matrix = T_world_cam.Matrix();
  matrix.middleCols<2>(1) *= -1;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  }
  return rows;
}

// With the images written into `folder`, free of distortion.
std::vector<RunImage> WithoutLenses(const std::vector<RunImage>& images, const fs::path& folder) {
  CreateOutputFolder(folder);
  std::vector<std::pair<CameraModel, std::unique_ptr<Undistorter>>> undistorters;
  std::vector<RunImage> undistorted = images;
  for (RunImage& image : undistorted) {
    if (undistorters.empty() || undistorters.back().first != image.camera) {
      undistorters.emplace_back(image.camera, std::make_unique<Undistorter>(image.camera));
    }
    const Undistorter& undistorter = *undistorters.back().second;
    const cv::Mat bgr = undistorter.Undistort(ReadRunImage(image));
    image.camera = undistorter.camera();
    image.file = folder / (fs::path(image.name).stem().string() + ".png");
    WritePng(image.file, bgr);
  }
  return undistorted;
}

bool HaveOneCamera(const std::vector<RunImage>& images) {
  for (const RunImage& image : images) {
    if (image.camera != images[0].camera) return false;
  }
  return true;
}

PointCloud CloudOf(const SparseModel& sparse) {
  PointCloud cloud;
  for (const SparsePoint& point : sparse.points) {
    cloud.points.push_back(point.p_world.cast<float>());
    cloud.colours.push_back(point.colour);
  }
  return cloud;
}

}  // namespace

std::vector<fs::path> WriteNerfstudio(const fs::path& folder, const FinishedRun& run,
                                      bool is_undistorted) {
  std::vector<RunImage> images = ImagesThatAreThere(run, "transforms.json");
  CreateOutputFolder(folder);
  if (is_undistorted) images = WithoutLenses(images, folder / "images");
  std::vector<fs::path> written;
  const bool is_one = HaveOneCamera(images);
  nlohmann::ordered_json record;
  if (is_one) record = ParametersOf(images[0].camera);
  record["applied_transform"] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  if (!run.sparse.points.empty()) {
    written.push_back(folder / "sparse.ply");
    WritePly(written.back(), CloudOf(run.sparse));
    record["ply_file_path"] = "sparse.ply";
  }
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (const RunImage& image : images) {
    nlohmann::ordered_json frame =
        is_one ? nlohmann::ordered_json::object() : ParametersOf(image.camera);
    frame["file_path"] = fs::absolute(image.file)
                             .lexically_normal()
                             .lexically_proximate(fs::absolute(folder).lexically_normal())
                             .generic_string();
    frame["transform_matrix"] = TransformOf(image.T_world_cam);
    frames.push_back(std::move(frame));
  }
  record["frames"] = std::move(frames);
  written.push_back(folder / "transforms.json");
  // Names of files are bytes: what is no UTF-8 becomes U+FFFD.
  using OnError = nlohmann::ordered_json::error_handler_t;
  WriteFileAtomically(written.back(), record.dump(1, ' ', false, OnError::replace) + "\n");
  return written;
}

}  // namespace mono3d
