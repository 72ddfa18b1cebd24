// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/depth_views.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <system_error>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/trajectory_file.h"
#include "products/run_record.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

std::string FrameDigits(std::int64_t frame) {
  std::string digits = std::to_string(frame);
  digits.insert(0, digits.size() < 6 ? 6 - digits.size() : 0, '0');
  return digits;
}

// Numbers of the frames whose depth maps were fused, ascending.
std::set<std::int64_t> FusedFrames(const nlohmann::json& record) {
  std::set<std::int64_t> frames;
  const nlohmann::json::json_pointer place("/maps/0/fusions");
  if (!record.contains(place) || !record[place].is_array()) return frames;
  for (const nlohmann::json& fusion : record[place]) {
    if (!fusion.is_object() || !fusion.contains("frame") || !fusion["frame"].is_number_integer() ||
        !fusion.contains("fused") || fusion["fused"] != true) {
      continue;
    }
    frames.insert(fusion["frame"].get<std::int64_t>());
  }
  return frames;
}

std::vector<std::string> InputImages(const nlohmann::json& record) {
  if (!record.contains("input") || !record["input"].is_string()) return {};
  const std::string input = record["input"].get<std::string>();
  std::error_code ignored;
  if (input.empty() || fs::is_regular_file(input, ignored)) return {};
  try {
    return ListImages(input);
  } catch (const Error&) {  // it has moved
    return {};
  }
}

}  // namespace

std::vector<RunImage> DepthViews(const FinishedRun& run) {
  std::vector<RunImage> views;
  std::set<fs::path> known;
  for (const RunImage& image : run.images) {
    if (image.depth.empty()) continue;
    views.push_back(image);
    known.insert(image.depth.filename());
  }
  // Several cameras: nobody says here which of them took an image.
  if (run.images.empty() || !run.sparse.further_cameras.empty()) return views;
  const nlohmann::json record = ReadRunRecord(run.folder / "run.json");
  const std::set<std::int64_t> frames = FusedFrames(record);
  std::vector<StampedPose> poses;
  try {
    if (!frames.empty()) poses = ReadTrajectory(run.folder / "model_trajectory.txt");
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string(error.what()) + "; depth maps are left out");
  }
  // Both are in the order of time; one for each only where the run has one map.
  if (poses.size() != frames.size()) return views;
  const std::vector<std::string> images = InputImages(record);
  std::size_t i = 0;
  for (const std::int64_t frame : frames) {
    const Pose& T_world_cam = poses[i++].T_world_cam;
    const std::string digits = FrameDigits(frame);
    for (const char* ending : {".pfm", ".exr", "16.png"}) {
      const fs::path file_of_depth = run.folder / "depth" / (digits + ".depth" + ending);
      std::error_code ignored;
      if (!fs::exists(file_of_depth, ignored) || known.contains(file_of_depth.filename())) continue;
      RunImage view;
      view.name = digits + ".jpg";
      if (frame >= 0 && static_cast<std::size_t>(frame) < images.size()) {
        view.file = images[static_cast<std::size_t>(frame)];
        view.name = view.file.filename().string();
      }
      view.camera = run.sparse.camera;
      view.T_world_cam = T_world_cam;
      view.depth = file_of_depth;
      const fs::path confidence = run.folder / "depth" / (digits + ".confidence" + ending);
      if (fs::exists(confidence, ignored)) view.confidence = confidence;
      views.push_back(std::move(view));
      break;
    }
  }
  return views;
}

}  // namespace mono3d
