// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/dense_workspace.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/output_file.h"
#include "mono3d/products/run_image.h"
#include "products/depth_views.h"
#include "products/jpeg.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

void RequireDepthMaps(const std::vector<RunImage>& views, const FinishedRun& run) {
  if (!views.empty() && run.depth_camera.width > 0) return;
  throw Error(ErrorParts{"the run has no depth maps", run.folder.string(),
                         "depth/, which --depth-files none leaves out", "none",
                         ErrorCode::kNotFound});
}

// In the unit of the model.
cv::Mat DepthOf(const RunImage& image, const FinishedRun& run) {
  cv::Mat depth = ReadDepthImage(image.depth);
  if (depth.cols != run.depth_camera.width || depth.rows != run.depth_camera.height) {
    throw Error(ErrorParts{
        "depth map has another size than depth/camera.yaml", image.depth.string(),
        std::to_string(run.depth_camera.width) + "x" + std::to_string(run.depth_camera.height),
        std::to_string(depth.cols) + "x" + std::to_string(depth.rows)});
  }
  depth *= run.depth_unit;
  return depth;
}

// "000012.depth.exr" -> "000012.normal.exr"; empty where it is not there.
fs::path NormalFileOf(const fs::path& depth_file) {
  std::string name = depth_file.filename().string();
  constexpr std::string_view kDepth = ".depth";
  const std::size_t at = name.find(kDepth);
  if (at == std::string::npos) return {};
  name.replace(at, kDepth.size(), ".normal");
  fs::path file = depth_file.parent_path() / name;
  std::error_code ignored;
  return fs::exists(file, ignored) ? file : fs::path();
}

// Where a lens without distortion shows what the lens with it shows at a pixel. Nothing: the search
// does not end there, at the border of wide lenses.
std::optional<Eigen::Vector2d> WithoutLens(const CameraModel& camera,
                                           const Eigen::Vector2d& pixel) {
  constexpr int kMostSteps = 50;
  constexpr double kExact_px = 1e-6;
  Eigen::Vector3d ray = camera.Unproject(pixel);
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Vector2d error = pixel - ProjectDistorted(camera, ray);
    if (!error.allFinite()) return std::nullopt;
    if (error.norm() < kExact_px) return Eigen::Vector2d(ray.x(), ray.y());
    ray.x() += error.x() / camera.fx;
    ray.y() += error.y() / camera.fy;
  }
  return std::nullopt;
}

// The sparse model in images of `pinhole`, without the observations that these do not show.
SparseModel SparseIn(const CameraModel& pinhole, const SparseModel& sparse,
                     const std::vector<RunImage>& images) {
  SparseModel seen;
  seen.camera = pinhole;
  seen.points = sparse.points;
  for (const SparseImage& image : sparse.images) {
    bool is_there = false;
    for (const RunImage& of_run : images) is_there = is_there || of_run.name == image.name;
    if (!is_there) continue;
    SparseImage of_pinhole = image;
    of_pinhole.camera = 0;
    of_pinhole.observations.clear();
    const CameraModel& camera = sparse.CameraOf(image);
    for (SparseObservation observation : image.observations) {
      const auto place =
          camera.HasDistortion()
              ? WithoutLens(camera, observation.pixel)
              : std::optional<Eigen::Vector2d>(camera.Unproject(observation.pixel).head<2>());
      if (!place) continue;
      observation.pixel = pinhole.Project({place->x(), place->y(), 1});
      if (pinhole.Contains(observation.pixel)) of_pinhole.observations.push_back(observation);
    }
    seen.images.push_back(std::move(of_pinhole));
  }
  // Images of depth maps that are no longer in the sparse model.
  std::int64_t next_id = 0;
  for (const SparseImage& image : sparse.images) next_id = std::max(next_id, image.id + 1);
  for (const RunImage& image : images) {
    if (std::ranges::find(sparse.images, image.name, &SparseImage::name) != sparse.images.end()) {
      continue;
    }
    SparseImage added;
    added.id = next_id++;
    added.name = image.name;
    added.T_world_cam = image.T_world_cam;
    seen.images.push_back(std::move(added));
  }
  return seen;
}

void WriteDepthAndNormals(const fs::path& stereo, const RunImage& image, const FinishedRun& run,
                          double min_confidence) {
  cv::Mat depth = DepthOf(image, run);
  cv::Mat normal;
  if (const fs::path file = NormalFileOf(image.depth); !file.empty()) normal = ReadNormals(file);
  if (min_confidence > 0 && !image.confidence.empty()) {
    const cv::Mat confidence = ReadConfidence(image.confidence);
    if (confidence.size() == depth.size()) depth.setTo(0, confidence < min_confidence);
  }
  WriteColmapArray(stereo / "depth_maps" / (image.name + ".geometric.bin"), depth);
  if (normal.size() != depth.size()) return;
  normal.setTo(cv::Scalar::all(0), depth == 0);
  WriteColmapArray(stereo / "normal_maps" / (image.name + ".geometric.bin"), normal);
}

}  // namespace

void WriteColmapArray(const fs::path& file, const cv::Mat& matrix) {
  if (matrix.empty() || matrix.depth() != CV_32F) {
    throw Error(ErrorParts{"no matrix of floats", file.string(), "32-bit floats", "none"});
  }
  std::string bytes = std::to_string(matrix.cols) + "&" + std::to_string(matrix.rows) + "&" +
                      std::to_string(matrix.channels()) + "&";
  std::vector<cv::Mat> channels;
  cv::split(matrix, channels);
  for (const cv::Mat& channel : channels) {
    for (int y = 0; y < channel.rows; ++y) {
      bytes.append(reinterpret_cast<const char*>(channel.ptr<float>(y)),
                   sizeof(float) * static_cast<std::size_t>(channel.cols));
    }
  }
  WriteFileAtomically(file, bytes);
}

std::vector<fs::path> WriteDenseWorkspace(const fs::path& folder, const FinishedRun& run,
                                          double min_confidence) {
  const std::vector<RunImage> views = DepthViews(run);
  RequireDepthMaps(views, run);
  std::vector<RunImage> images = ImagesThatAreThere(run, "a dense workspace");
  for (const RunImage& view : views) {
    const bool is_known = std::ranges::find(images, view.name, &RunImage::name) != images.end();
    if (!is_known && !view.file.empty()) images.push_back(view);
  }
  const CameraModel pinhole = run.depth_camera.WithoutDistortion();
  for (const char* part : {"images", "sparse", "stereo/depth_maps", "stereo/normal_maps",
                           "stereo/consistency_graphs"}) {
    CreateOutputFolder(folder / part);
  }
  std::vector<std::pair<CameraModel, std::unique_ptr<Undistorter>>> undistorters;
  std::string with_depth, sources;
  for (const RunImage& image : images) {
    if (undistorters.empty() || undistorters.back().first != image.camera) {
      undistorters.emplace_back(image.camera, std::make_unique<Undistorter>(image.camera, pinhole));
    }
    // Under its own name, which sparse/ gives; of the form that its ending says.
    std::vector<unsigned char> bytes;
    const cv::Mat bgr = undistorters.back().second->Undistort(ReadRunImage(image));
    const std::string ending = fs::path(image.name).extension().string();
    if (!cv::haveImageWriter(image.name) || !cv::imencode(ending, bgr, bytes)) {
      bytes = JpegOf(bgr, 95);
    }
    WriteFileAtomically(folder / "images" / image.name,
                        {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                        Durability::kInCache);
    // What patch_match_stereo would be told: estimate it from the 20 best others.
    sources += image.name + "\n__auto__, 20\n";
    if (image.depth.empty()) continue;
    WriteDepthAndNormals(folder / "stereo", image, run, min_confidence);
    with_depth += image.name + "\n";
  }
  WriteColmapModel(folder / "sparse", SparseIn(pinhole, run.sparse, images));
  WriteFileAtomically(folder / "stereo" / "fusion.cfg", with_depth);
  WriteFileAtomically(folder / "stereo" / "patch-match.cfg", sources);
  return {folder / "images", folder / "sparse", folder / "stereo"};
}

std::vector<fs::path> WriteDepthTiffs(const fs::path& folder, const FinishedRun& run) {
  const std::vector<RunImage> views = DepthViews(run);
  RequireDepthMaps(views, run);
  CreateOutputFolder(folder);
  std::vector<fs::path> written;
  for (const RunImage& view : views) {
    const cv::Mat depth = DepthOf(view, run);
    std::vector<unsigned char> bytes;
    cv::imencode(".tif", depth, bytes);
    written.push_back(folder / (fs::path(view.name).stem().string() + ".tif"));
    WriteFileAtomically(written.back(),
                        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  return written;
}

}  // namespace mono3d
