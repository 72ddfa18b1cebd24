// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_writer.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/out_of_memory.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "pipeline/run_json.h"

namespace mono3d {
namespace {

constexpr std::array kTrajectoryNames = {"trajectory", "trajectory_online", "keyframes",
                                         "model_trajectory"};

constexpr std::string_view kCameraName = "learned_camera.yaml";
constexpr std::string_view kKeyframeImageFolder = "images_global_shutter";

// "trajectory.txt" for the first map, "trajectory_map3.txt" for a further one.
std::string NameOfMap(const std::string& stem, const std::string& extension, bool is_first,
                      int map_id) {
  return is_first ? stem + extension : stem + "_map" + std::to_string(map_id) + extension;
}

bool IsNumber(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

// What stays of `name` without the ending; nothing where it has another one.
std::optional<std::string_view> WithoutEnding(std::string_view name, std::string_view ending) {
  if (!name.ends_with(ending)) return std::nullopt;
  return name.substr(0, name.size() - ending.size());
}

// "learned_camera_2.yaml"
constexpr std::string_view kCameraStem = "learned_camera_";

std::string NameOfCamera(std::size_t number) {
  return std::string(kCameraStem) + std::to_string(number) + ".yaml";
}

bool IsNameOfCamera(std::string_view name) {
  const std::optional<std::string_view> stem = WithoutEnding(name, ".yaml");
  return stem && stem->starts_with(kCameraStem) && IsNumber(stem->substr(kCameraStem.size()));
}

// As NameOfMap makes them.
bool IsNameOfMap(std::string_view name, std::string_view stem, std::string_view extension) {
  const std::optional<std::string_view> rest = WithoutEnding(name, extension);
  constexpr std::string_view kMap = "_map";
  if (!rest || !rest->starts_with(stem)) return false;
  const std::string_view number = rest->substr(stem.size());
  return number.empty() || (number.starts_with(kMap) && IsNumber(number.substr(kMap.size())));
}

bool IsRunFile(std::string_view name) {
  const auto is_text = [&](const char* stem) { return IsNameOfMap(name, stem, ".txt"); };
  return name == "run.json" || name == kCameraName || IsNameOfCamera(name) ||
         IsNameOfMap(name, "model", ".ply") || IsNameOfMap(name, "mesh", ".ply") ||
         std::ranges::any_of(kTrajectoryNames, is_text);
}

constexpr std::array<std::string_view, 6> kDepthEndings = {
    ".depth.pfm", ".depth.png", ".normal.pfm", ".normal.png", ".confidence.pfm", ".confidence.png"};

std::string DepthMapName(std::int64_t frame_index) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06lld", static_cast<long long>(frame_index));
  return name.data();
}

bool IsDepthFile(std::string_view name) {
  const std::size_t dot = std::min(name.find('.'), name.size());
  constexpr std::size_t kMinDigits = 6;
  if (dot < kMinDigits || !IsNumber(name.substr(0, dot))) return false;
  return std::ranges::count(kDepthEndings, name.substr(dot)) > 0;
}

bool IsPng(std::string_view name) { return name.ends_with(".png"); }

bool IsSparseFile(std::string_view name) {
  return name == "cameras.txt" || name == "images.txt" || name == "points3D.txt";
}

void RemoveFile(const std::filesystem::path& file) {
  std::error_code failure;
  std::filesystem::remove(file, failure);
  if (failure) {
    throw Error(ErrorParts{.what = "cannot remove the file of an earlier run",
                           .where = file.string(),
                           .expected = {},
                           .found = failure.message()});
  }
}

// Removes the files of `folder` whose names match, and what was left of them half written. A folder
// that is not there has none.
void RemoveMatching(const std::filesystem::path& folder, bool (*matches)(std::string_view)) {
  // Listed first: what a listing shows of a folder that shrinks meanwhile is not defined.
  std::vector<std::filesystem::path> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (matches(WithoutEnding(name, ".partial").value_or(name))) files.push_back(entry.path());
  }
  for (const std::filesystem::path& file : files) RemoveFile(file);
}

// The folder goes as soon as nothing but what was written there is in it.
void RemoveFolder(const std::filesystem::path& folder, bool (*matches)(std::string_view)) {
  RemoveMatching(folder, matches);
  std::error_code not_empty;
  std::filesystem::remove(folder, not_empty);
}

// The folders sparse and sparse_mapN.
void RemoveSparseModels(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> models;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (IsNameOfMap(name, "sparse", "")) models.push_back(entry.path());
  }
  for (const std::filesystem::path& model : models) RemoveFolder(model, IsSparseFile);
}

void WriteEntries(const std::filesystem::path& path, const std::vector<TrajectoryEntry>& entries) {
  std::vector<StampedPose> poses;
  poses.reserve(entries.size());
  for (const TrajectoryEntry& entry : entries) {
    poses.push_back({entry.timestamp_s, entry.T_world_cam});
  }
  WriteTrajectory(path, poses);
}

}  // namespace

RunWriter::RunWriter(const std::filesystem::path& folder) : folder_(folder) {
  CreateOutputFolder(folder_);
  CreateOutputFolder(folder_ / "depth");
  RemoveMatching(folder_ / "depth", IsDepthFile);
  RemoveMatching(folder_, IsRunFile);
  RemoveFolder(folder_ / kKeyframeImageFolder, IsPng);
  RemoveSparseModels(folder_);
}

void RunWriter::WriteDepthMap(const DepthMap& map) const {
  mono3d::WriteDepthMap(folder_ / "depth", DepthMapName(map.frame_index), map);
}

void RunWriter::RemoveDepthMap(std::int64_t frame_index) const {
  for (const std::string_view ending : kDepthEndings) {
    RemoveFile(folder_ / "depth" / (DepthMapName(frame_index) + std::string(ending)));
  }
}

void RunWriter::WriteKeyframeImage(const Frame& frame) const {
  const std::filesystem::path path = KeyframeImagePath(frame.name);
  if (!std::filesystem::exists(path.parent_path())) CreateOutputFolder(path.parent_path());
  WritePng(path, frame.bgr);
}

void RunWriter::RemoveKeyframeImage(const std::string& frame_name) const {
  RemoveFile(KeyframeImagePath(frame_name));
}

void RunWriter::WriteReconstruction(const Reconstruction& reconstruction) const {
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    const std::array<const std::vector<TrajectoryEntry>*, 4> lists = {
        &map.trajectory, &map.online_trajectory, &map.keyframes, &map.model_trajectory};
    for (std::size_t i = 0; i < lists.size(); ++i) {
      WriteEntries(folder_ / NameOfMap(kTrajectoryNames.at(i), ".txt", is_first, map.map_id),
                   *lists.at(i));
    }
    if (!map.model.empty()) {
      WritePly(folder_ / NameOfMap("model", ".ply", is_first, map.map_id), map.model);
    }
    is_first = false;
  }
}

void RunWriter::WriteMeshes(const Reconstruction& reconstruction,
                            const MeshOptions& options) const {
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    if (!map.model.empty()) {
      const std::filesystem::path path = folder_ / NameOfMap("mesh", ".ply", is_first, map.map_id);
      NamingOutOfMemory(path.string(),
                        [&] { WriteMeshPly(path, MeshSurfels(map.model, options)); });
    }
    is_first = false;
  }
}

void RunWriter::WriteSparseModels(const Reconstruction& reconstruction,
                                  const CameraModel& calibration) const {
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    WriteSparse(map, is_first, WithCamera(map.sparse, calibration));
    is_first = false;
  }
}

void RunWriter::WriteSparseModels(const Reconstruction& reconstruction,
                                  const CamerasOfImages& calibrations) const {
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    WriteSparse(map, is_first,
                WithCameras(map.sparse, calibrations.cameras,
                            [&](std::int64_t frame) { return calibrations.Of(frame); }));
    is_first = false;
  }
}

void RunWriter::WriteSparseModelsOfKeyframeImages(const Reconstruction& reconstruction) const {
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    SparseModel sparse = map.sparse;
    std::erase_if(sparse.images, [&](const SparseImage& image) {
      return !std::filesystem::exists(KeyframeImagePath(image.name));
    });
    for (SparseImage& image : sparse.images) {
      image.name = KeyframeImagePath(image.name).filename().string();
    }
    WriteSparse(map, is_first, sparse);
    is_first = false;
  }
}

void RunWriter::WriteSparse(const MapReconstruction& map, bool is_first,
                            const SparseModel& sparse) const {
  if (sparse.images.empty()) return;
  WriteColmapModel(folder_ / NameOfMap("sparse", "", is_first, map.map_id), sparse);
}

std::filesystem::path RunWriter::KeyframeImagePath(const std::string& frame_name) const {
  const std::string name = std::filesystem::path(frame_name).filename().string();
  return folder_ / kKeyframeImageFolder / (IsPng(name) ? name : name + ".png");
}

void RunWriter::WriteCamera(const CameraModel& learned) const {
  WriteCameraFile(folder_ / kCameraName, learned);
}

void RunWriter::WriteCamera(const CameraModel& learned, std::size_t number) const {
  WriteCameraFile(folder_ / NameOfCamera(number), learned);
}

void RunWriter::WriteRecord(const Reconstruction& reconstruction, const RunRecord& record) const {
  WriteFileAtomically(folder_ / "run.json", RunJson(reconstruction, record));
}

}  // namespace mono3d
