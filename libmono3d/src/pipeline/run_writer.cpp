// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_writer.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <regex>
#include <system_error>

#include "core/out_of_memory.h"
#include "mono3d/core/error.h"
#include "mono3d/core/version.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kTrajectoryNames = {"trajectory", "trajectory_online", "keyframes",
                                         "model_trajectory"};

// "trajectory.txt" for the first map, "trajectory_map3.txt" for a further one.
std::string NameOfMap(const std::string& stem, const std::string& extension, bool is_first,
                      int map_id) {
  return is_first ? stem + extension : stem + "_map" + std::to_string(map_id) + extension;
}

// Removes the files of `folder` whose names match. A folder that is not there has none.
void RemoveMatching(const std::filesystem::path& folder, const std::regex& pattern) {
  // Listed first: what a listing shows of a folder that shrinks meanwhile is not defined.
  std::vector<std::filesystem::path> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (std::regex_match(entry.path().filename().string(), pattern)) files.push_back(entry.path());
  }
  for (const std::filesystem::path& file : files) {
    std::error_code failure;
    std::filesystem::remove(file, failure);
    if (failure) {
      throw Error(ErrorParts{.what = "cannot remove the file of an earlier run",
                             .where = file.string(),
                             .expected = {},
                             .found = failure.message()});
    }
  }
}

// The folders sparse and sparse_mapN go as soon as nothing but what was written there is in them.
void RemoveSparseModels(const std::filesystem::path& folder) {
  static const std::regex kName(R"(sparse(_map\d+)?)");
  std::vector<std::filesystem::path> models;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (std::regex_match(entry.path().filename().string(), kName)) models.push_back(entry.path());
  }
  for (const std::filesystem::path& model : models) {
    RemoveMatching(model, std::regex(R"((cameras|images|points3D)\.txt(\.partial)?)"));
    std::error_code not_empty;
    std::filesystem::remove(model, not_empty);
  }
}

void WriteEntries(const std::filesystem::path& path, const std::vector<TrajectoryEntry>& entries) {
  std::vector<StampedPose> poses;
  poses.reserve(entries.size());
  for (const TrajectoryEntry& entry : entries) {
    poses.push_back({entry.timestamp_s, entry.T_world_cam});
  }
  WriteTrajectory(path, poses);
}

const char* ToString(RunEnd end) {
  switch (end) {
    case RunEnd::kFinished:
      return "finished";
    case RunEnd::kStopped:
      return "stopped";
    case RunEnd::kFailed:
      return "failed";
  }
  return "unknown";
}

// The options as one object, by their dotted names.
Json OptionsJson(const std::vector<OptionField>& options) {
  Json json = Json::object();
  for (const OptionField& field : options) {
    std::visit([&](const auto* value) { json[field.name] = *value; }, field.value);
  }
  return json;
}

Json CountsJson(const PipelineCounts& counts, std::int64_t num_skipped_images) {
  return {{"frames", counts.num_frames},
          {"images_skipped", num_skipped_images},
          {"tracked", counts.num_tracked},
          {"recovered", counts.num_recovered},
          {"keyframes", counts.num_keyframes},
          {"keyframes_without_image", counts.num_keyframes_without_image},
          {"bundles", counts.num_bundles},
          {"bundles_dropped", counts.num_dropped_bundles},
          {"depth_maps", counts.num_depth_maps},
          {"fused", counts.num_fused},
          {"fused_late", counts.num_fused_late},
          {"repairs", counts.num_repairs},
          {"submaps_started", counts.num_submaps_started},
          {"submaps_joined", counts.num_submaps_joined},
          {"models_joined", counts.num_models_joined},
          {"corrections", counts.num_corrections},
          {"constraints", counts.num_constraints},
          {"untracked_frames", counts.untracked_frames},
          {"rejected_bundles", counts.rejected_bundles},
          {"rejected_depth_maps", counts.rejected_depth_maps}};
}

// Over the points, of each one's mean: what COLMAP calls the mean reprojection error.
double MeanReprojection_px(const SparseModel& model) {
  const std::vector<double> errors_px = ReprojectionErrors_px(model);
  double sum = 0;
  for (const double error_px : errors_px) sum += error_px;
  return errors_px.empty() ? 0 : sum / static_cast<double>(errors_px.size());
}

Json HealthJson(const ModelHealth& health) {
  Json json = {{"state", ToString(health.state)},
               {"registrations", health.num_registrations},
               {"accepted_share", health.accepted_share},
               {"moved_share", health.moved_share},
               {"depth_residual_sigmas", health.depth_residual},
               {"scale_drift", health.scale_drift},
               {"deviation_px", health.deviation_px},
               {"submaps", health.num_submaps}};
  if (!health.reason.empty()) json["reason"] = health.reason;
  return json;
}

Json HealthChangesJson(const std::vector<HealthChange>& changes) {
  Json list = Json::array();
  for (const HealthChange& change : changes) {
    Json json = {{"frame", change.frame_index}, {"state", ToString(change.state)}};
    if (!change.reason.empty()) json["reason"] = change.reason;
    list.push_back(std::move(json));
  }
  return list;
}

Json SubmapJoinsJson(const std::vector<SubmapJoin>& joins) {
  Json list = Json::array();
  for (const SubmapJoin& join : joins) {
    list.push_back({{"frame", join.frame_index},
                    {"submaps", join.num_submaps},
                    {"moved_px", join.moved_px},
                    {"scale", join.scale},
                    {"merged", join.num_merged}});
  }
  return list;
}

// One line of evidence per attempt.
Json FusionsJson(const std::vector<FusionRecord>& fusions) {
  Json list = Json::array();
  for (const FusionRecord& fusion : fusions) {
    const RegistrationEvidence& evidence = fusion.registration;
    Json json = {{"frame", fusion.frame_index}, {"fused", fusion.status == FusionStatus::kFused}};
    if (!fusion.reason.empty()) json["reason"] = fusion.reason;
    if (fusion.is_retry) json["retry"] = true;
    if (fusion.starts_submap) json["starts_submap"] = true;
    if (fusion.is_repaired) json["repair"] = true;
    json["registered"] = evidence.registered;
    if (evidence.registered) {
      json["moved"] = evidence.moved;
      json["overlap"] = evidence.overlap;
      json["agreement"] = evidence.agreement;
      json["contradiction"] = evidence.contradiction;
      json["depth_residual_sigmas"] = evidence.depth_residual;
      json["grey_residual_sigmas"] = evidence.grey_residual;
      json["tracker_misfit_sigmas"] = evidence.tracker_misfit;
      json["deviation_px"] = evidence.deviation_px;
      json["scale_deviation"] = evidence.scale_deviation;
      json["uncertainty_px"] = evidence.uncertainty_px;
    }
    list.push_back(std::move(json));
  }
  return list;
}

Json MapsJson(const std::vector<MapReconstruction>& maps) {
  Json list = Json::array();
  for (const MapReconstruction& map : maps) {
    list.push_back({{"map", map.map_id},
                    {"frames", map.trajectory.size()},
                    {"keyframes", map.keyframes.size()},
                    {"depth_maps_fused", map.model_trajectory.size()},
                    {"surfels", map.model.size()},
                    {"sparse_images", map.sparse.images.size()},
                    {"sparse_points", map.sparse.points.size()},
                    {"sparse_reprojection_px", MeanReprojection_px(map.sparse)},
                    {"health", HealthJson(map.health)},
                    {"health_changes", HealthChangesJson(map.health_changes)},
                    {"submap_joins", SubmapJoinsJson(map.submap_joins)},
                    {"fusions", FusionsJson(map.fusions)}});
  }
  return list;
}

Json LiveJson(const LiveRecord& live) {
  Json dropped = Json::object();
  if (live.num_dropped_frames > 0) {
    dropped["waited longer than live.max_delay_s"] = live.num_dropped_frames;
  }
  return {{"frames_dropped", dropped},
          {"frames_per_s", live.frames_per_s},
          {"latency_ms",
           {{"mean", live.mean_latency_ms},
            {"p95", live.p95_latency_ms},
            {"max", live.max_latency_ms}}}};
}

Json StagesJson(const std::vector<StageTime>& stages) {
  Json json = Json::object();
  for (const StageTime& stage : stages) {
    json[stage.stage] = {{"calls", stage.num_calls},
                         {"wall_ms", stage.wall_ms},
                         {"gpu_ms", stage.gpu_ms},
                         {"cpu_ms", stage.cpu_ms}};
  }
  return json;
}

}  // namespace

RunWriter::RunWriter(const std::filesystem::path& folder) : folder_(folder) {
  CreateOutputFolder(folder_);
  CreateOutputFolder(folder_ / "depth");
  RemoveMatching(folder_ / "depth",
                 std::regex(R"(\d{6,}\.(depth|normal|confidence)\.(pfm|png)(\.partial)?)"));
  RemoveMatching(
      folder_, std::regex(R"(((trajectory|trajectory_online|keyframes|model_trajectory))"
                          R"((_map\d+)?\.txt|(model|mesh)(_map\d+)?\.ply|run\.json)(\.partial)?)"));
  RemoveSparseModels(folder_);
}

void RunWriter::WriteDepthMap(const DepthMap& map) const {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06lld", static_cast<long long>(map.frame_index));
  mono3d::WriteDepthMap(folder_ / "depth", name.data(), map);
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
    if (!map.sparse.images.empty()) {
      WriteColmapModel(folder_ / NameOfMap("sparse", "", is_first, map.map_id),
                       WithCamera(map.sparse, calibration));
    }
    is_first = false;
  }
}

void RunWriter::WriteRecord(const Reconstruction& reconstruction, const RunRecord& record) const {
  Json json;
  json["mono3d"] = Version();
  json["end"] = ToString(record.end);
  if (!record.error.empty()) json["error"] = record.error;
  json["input"] = record.input;
  json["camera"] = record.camera;
  json["device"] = {
      {"name", record.device.name}, {"type", record.device.type}, {"driver", record.device.driver}};
  json["options"] = OptionsJson(record.options);
  json["counts"] = CountsJson(reconstruction.counts, record.num_skipped_images);
  if (record.live) json["live"] = LiveJson(*record.live);
  json["maps"] = MapsJson(reconstruction.maps);
  json["times"] = {{"wall_s", record.wall_s}, {"cpu_s", record.cpu_s}};
  json["stages"] = StagesJson(record.stages);
  json["peak_memory_bytes"] = PeakMemoryBytes();
  // Invalid UTF-8 in a path must not cost the user the record.
  WriteFileAtomically(folder_ / "run.json",
                      json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace mono3d
