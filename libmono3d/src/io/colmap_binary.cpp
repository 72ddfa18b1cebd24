// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/colmap_binary.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "io/binary_block.h"
#include "io/colmap_cameras.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

constexpr double kToPixelCentre = 0.5;  // COLMAP's pixel (0, 0) is a corner
constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};

template <typename T>
void AppendValue(std::string& block, T value) {
  AppendBytes(block, &value, 1);
}

// Ids are one more than ours.
std::uint32_t IdInColmap(std::int64_t id) { return static_cast<std::uint32_t>(id + 1); }

std::string CamerasBytes(const SparseModel& model) {
  std::string block;
  const std::size_t num_cameras = 1 + model.further_cameras.size();
  AppendValue<std::uint64_t>(block, num_cameras);
  for (std::size_t i = 0; i < num_cameras; ++i) {
    const CameraModel& camera = i == 0 ? model.camera : model.further_cameras[i - 1];
    const ColmapCamera form = ToColmapCamera(camera);
    AppendValue(block, IdInColmap(static_cast<std::int64_t>(i)));
    AppendValue<std::int32_t>(block, form.model_id);
    AppendValue<std::uint64_t>(block, static_cast<std::uint64_t>(camera.width));
    AppendValue<std::uint64_t>(block, static_cast<std::uint64_t>(camera.height));
    AppendBytes(block, form.params.data(), form.params.size());
  }
  return block;
}

void AppendImage(const SparseImage& image, std::string& block) {
  const Pose T_cam_world = image.T_world_cam.Inverse();
  const Eigen::Quaterniond& q = T_cam_world.rotation();
  const Eigen::Vector3d& t = T_cam_world.translation();
  AppendValue(block, IdInColmap(image.id));
  for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
    AppendValue(block, value);
  }
  AppendValue(block, IdInColmap(static_cast<std::int64_t>(image.camera)));
  block.append(image.name.c_str(), image.name.size() + 1);  // with the 0 at its end
  AppendValue<std::uint64_t>(block, image.observations.size());
  for (const SparseObservation& observation : image.observations) {
    AppendValue(block, observation.pixel.x() + kToPixelCentre);
    AppendValue(block, observation.pixel.y() + kToPixelCentre);
    AppendValue<std::uint64_t>(block, observation.point ? *observation.point + 1 : kNoPoint);
  }
}

void WriteImages(const std::filesystem::path& path, const SparseModel& model) {
  AtomicFile file(path);
  std::string block;
  AppendValue<std::uint64_t>(block, model.images.size());
  for (const SparseImage& image : model.images) {
    AppendImage(image, block);
    WriteWhenFull(file, block);
  }
  file.Write(block);
  file.Commit();
}

void WritePoints(const std::filesystem::path& path, const SparseModel& model) {
  // Of each point: the images that show it, and which of their observations does.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> tracks(model.points.size());
  for (const SparseImage& image : model.images) {
    for (std::size_t i = 0; i < image.observations.size(); ++i) {
      const auto& point = image.observations[i].point;
      if (point) tracks[*point].emplace_back(IdInColmap(image.id), static_cast<std::uint32_t>(i));
    }
  }
  const std::vector<double> errors_px = ReprojectionErrors_px(model);
  AtomicFile file(path);
  std::string block;
  AppendValue<std::uint64_t>(block, model.points.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const SparsePoint& point = model.points[i];
    AppendValue<std::uint64_t>(block, i + 1);
    AppendBytes(block, point.p_world.data(), 3);
    AppendBytes(block, point.colour.data(), 3);
    AppendValue(block, errors_px[i]);
    AppendValue<std::uint64_t>(block, tracks[i].size());
    for (const auto& [image_id, position] : tracks[i]) {
      AppendValue(block, image_id);
      AppendValue(block, position);
    }
    WriteWhenFull(file, block);
  }
  file.Write(block);
  file.Commit();
}

}  // namespace

void WriteColmapBinary(const std::filesystem::path& folder, const SparseModel& model) {
  WriteFileAtomically(folder / "cameras.bin", CamerasBytes(model));
  WriteImages(folder / "images.bin", model);
  WritePoints(folder / "points3D.bin", model);
}

}  // namespace mono3d
