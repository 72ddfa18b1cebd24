// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_writer.h"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "core/out_of_memory.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "pipeline/run_files.h"
#include "pipeline/run_json.h"

namespace mono3d {
namespace {

void WriteEntries(const std::filesystem::path& path, const std::vector<TrajectoryEntry>& entries) {
  std::vector<StampedPose> poses;
  poses.reserve(entries.size());
  for (const TrajectoryEntry& entry : entries) {
    poses.push_back({entry.timestamp_s, entry.T_world_cam});
  }
  WriteTrajectory(path, poses);
}

// Steps that do not depend on each other.
class Attempts {
 public:
  template <typename Step>
  void Try(const Step& step) {
    try {
      NamingOutOfMemory("writing the results", step);
    } catch (const Error& error) {
      if (error_) Log(LogLevel::kWarning, error.what());
      if (!error_) error_ = error;
    }
  }
  // The first error; the others have been logged.
  void Throw() const {
    if (error_) throw Error(*error_);
  }

 private:
  std::optional<Error> error_;
};

}  // namespace

RunWriter::RunWriter(const std::filesystem::path& folder, const DepthFileOptions& depth_files)
    : folder_(folder), depth_files_(depth_files) {
  CreateOutputFolder(folder_);
  RemoveRun(folder_);
  if (writes_depth_maps()) CreateOutputFolder(folder_ / kDepthFolder);
}

RunWriter::RunWriter(const std::filesystem::path& folder, const DepthFileOptions& depth_files,
                     Resumed)
    : folder_(folder), depth_files_(depth_files) {
  CreateOutputFolder(folder_);
  if (writes_depth_maps()) CreateOutputFolder(folder_ / kDepthFolder);
}

RunWriter RunWriter::OfRunToResume(const std::filesystem::path& folder,
                                   const DepthFileOptions& depth_files) {
  return RunWriter(folder, depth_files, Resumed());
}

void RunWriter::WriteDepthMap(const DepthMap& map) const {
  if (!writes_depth_maps()) return;
  MakeFolders();
  mono3d::WriteDepthMap(folder_ / kDepthFolder, DepthMapName(map.frame_index), map, depth_files_);
}

void RunWriter::WriteDepthCamera(const CameraModel& camera) const {
  if (!writes_depth_maps()) return;
  MakeFolders();
  if (depth_files_.form == DepthFileForm::kPng16) WriteDepthScale();
  WriteCameraFile(folder_ / kDepthFolder / kDepthCameraName, camera);
}

void RunWriter::WriteDepthScale() const {
  const std::filesystem::path path = folder_ / kDepthFolder / kDepthScaleName;
  const std::string text = std::to_string(std::lround(kDepthPngScale)) + "\n";
  std::ifstream earlier(path);
  if (earlier.is_open()) {
    const std::string found{std::istreambuf_iterator<char>(earlier), {}};
    if (found == text) return;
    throw Error(ErrorParts{.what = "the scale of other depth images is there: name another folder",
                           .where = path,
                           .expected = text.substr(0, text.size() - 1),
                           .found = found});
  }
  WriteFileAtomically(path, text);
}

void RunWriter::RemoveDepthMap(std::int64_t frame_index) const {
  for (const std::string_view ending : kDepthEndings) {
    RemoveRunFile(folder_ / kDepthFolder / (DepthMapName(frame_index) + std::string(ending)));
  }
}

void RunWriter::WriteKeyframeImage(const Frame& frame) const {
  const std::filesystem::path path = KeyframeImagePath(frame.name);
  if (!std::filesystem::exists(path.parent_path())) CreateOutputFolder(path.parent_path());
  WritePng(path, frame.bgr);
}

void RunWriter::RemoveKeyframeImage(const std::string& frame_name) const {
  RemoveRunFile(KeyframeImagePath(frame_name));
}

// Somebody may have removed them meanwhile.
void RunWriter::MakeFolders() const {
  std::error_code error;  // the file says why it cannot be written
  std::filesystem::create_directories(writes_depth_maps() ? folder_ / kDepthFolder : folder_,
                                      error);
}

void RunWriter::WriteReconstruction(const Reconstruction& reconstruction) const {
  MakeFolders();
  Attempts attempts;
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    const std::array<const std::vector<TrajectoryEntry>*, 4> lists = {
        &map.trajectory, &map.online_trajectory, &map.keyframes, &map.model_trajectory};
    for (std::size_t i = 0; i < lists.size(); ++i) {
      const std::string name = NameOfMap(kTrajectoryNames.at(i), ".txt", is_first, map.map_id);
      attempts.Try([&] { WriteEntries(folder_ / name, *lists.at(i)); });
    }
    is_first = false;
  }
  is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    const std::filesystem::path path = folder_ / NameOfMap("model", ".ply", is_first, map.map_id);
    // An interim model may be there, of another map.
    attempts.Try([&] { map.model.empty() ? RemoveRunFile(path) : WritePly(path, map.model); });
    is_first = false;
  }
  attempts.Throw();
}

void RunWriter::WriteInterim(const MapReconstruction& map) const {
  WriteEntries(folder_ / "trajectory.txt", map.trajectory);
  WriteEntries(folder_ / "keyframes.txt", map.keyframes);
  if (!map.model.empty()) WritePly(model_path(), map.model);
}

void RunWriter::WriteMeshes(const Reconstruction& reconstruction,
                            const MeshOptions& options) const {
  Attempts attempts;
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    const std::filesystem::path path = folder_ / NameOfMap("mesh", ".ply", is_first, map.map_id);
    is_first = false;
    if (map.model.empty()) continue;
    attempts.Try([&] {
      NamingOutOfMemory(path.string(),
                        [&] { WriteMeshPly(path, MeshSurfels(map.model, options)); });
    });
  }
  attempts.Throw();
}

void RunWriter::WriteSparseModels(const Reconstruction& reconstruction,
                                  const CameraModel& calibration) const {
  WriteSparseModels(reconstruction, CamerasOfImages{{calibration}});
}

void RunWriter::WriteSparseModels(const Reconstruction& reconstruction,
                                  const CamerasOfImages& calibrations) const {
  Attempts attempts;
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    attempts.Try([&] {
      WriteSparse(map, is_first,
                  WithCameras(map.sparse, calibrations.cameras,
                              [&](std::int64_t frame) { return calibrations.Of(frame); }));
    });
    is_first = false;
  }
  attempts.Throw();
}

void RunWriter::WriteSparseModelsOfKeyframeImages(const Reconstruction& reconstruction) const {
  Attempts attempts;
  bool is_first = true;
  for (const MapReconstruction& map : reconstruction.maps) {
    SparseModel sparse = map.sparse;
    std::erase_if(sparse.images, [&](const SparseImage& image) {
      return !std::filesystem::exists(KeyframeImagePath(image.name));
    });
    for (SparseImage& image : sparse.images) {
      image.name = KeyframeImagePath(image.name).filename().string();
    }
    attempts.Try([&] { WriteSparse(map, is_first, sparse); });
    is_first = false;
  }
  attempts.Throw();
}

void RunWriter::WriteSparse(const MapReconstruction& map, bool is_first,
                            const SparseModel& sparse) const {
  if (sparse.images.empty()) return;
  WriteColmapModel(folder_ / NameOfMap("sparse", "", is_first, map.map_id), sparse);
}

std::filesystem::path RunWriter::KeyframeImagePath(const std::string& frame_name) const {
  const std::string name = std::filesystem::path(frame_name).filename().string();
  return folder_ / kKeyframeImageFolder / (name.ends_with(".png") ? name : name + ".png");
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
