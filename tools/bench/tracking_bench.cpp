// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/tracking_bench.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "evaluate/depth_part.h"
#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/trajectory_error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

// The entries of the map with most frames.
std::vector<TrajectoryEntry> OfLargestMap(const std::vector<TrajectoryEntry>& entries) {
  std::map<int, std::int64_t> counts;
  for (const TrajectoryEntry& entry : entries) ++counts[entry.map_id];
  const auto largest =
      std::max_element(counts.begin(), counts.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<TrajectoryEntry> selected;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(selected),
               [&](const TrajectoryEntry& entry) { return entry.map_id == largest->first; });
  return selected;
}

std::optional<TrajectoryError> ErrorOf(const std::vector<TrajectoryEntry>& entries,
                                       const std::vector<StampedPose>& truth) {
  std::vector<StampedPose> poses;
  for (const TrajectoryEntry& entry : OfLargestMap(entries)) {
    poses.push_back({entry.timestamp_s, entry.T_world_cam});
  }
  try {
    return CompareTrajectories(poses, truth);
  } catch (const Error&) {
    return std::nullopt;  // too few poses, or all in one place
  }
}

void CompareTracking(const std::filesystem::path& folder, double mean_depth_m,
                     const std::vector<TrajectoryEntry>& trajectory,
                     const std::vector<TrajectoryEntry>& online, TrackingBenchResult& result) {
  if (trajectory.empty() || !std::filesystem::exists(folder / "groundtruth.txt")) return;
  const SequenceFiles sequence = FindSequenceFiles(folder);
  if (mean_depth_m > 0) {
    result.mean_depth_m = mean_depth_m;
  } else if (const auto mean = FindMeanDepth(sequence.depth, {})) {
    result.mean_depth_m = mean->metres;
  }
  const std::vector<StampedPose> truth = ReadTrajectory(sequence.groundtruth);
  if (const auto error = ErrorOf(trajectory, truth)) {
    result.final_rmse_m = error->position.rmse;
    result.final_rotation_deg = error->rotation_deg.rmse;
  }
  if (const auto error = ErrorOf(online, truth)) result.online_rmse_m = error->position.rmse;
}

// What is counted while the frames go by.
struct TrackedRun {
  std::vector<TrajectoryEntry> online;
  double thread_ms = 0;
  double read_ms = 0;
};

TrackedRun TrackAll(FrameSource& source, Tracker& tracker, TrackingBenchResult& result) {
  TrackedRun run;
  const auto timed = [](double& sum, const auto& work) {
    const double start_ms = ThreadCpuMs();
    work();
    const double spent_ms = ThreadCpuMs() - start_ms;
    sum += spent_ms;
    return spent_ms;
  };
  while (true) {
    std::optional<Frame> frame;
    timed(run.read_ms, [&] { frame = source.Next(); });
    if (!frame) break;
    TrackingResult tracked;
    const double spent_ms = timed(run.thread_ms, [&] { tracked = tracker.Track(*frame); });
    result.max_thread_ms = std::max(result.max_thread_ms, spent_ms);
    ++result.num_frames;
    const KeyframePosesPtr poses = tracker.Poses();
    for (const FramePose& recovered : tracked.recovered) {
      if (const auto entry = InWorld(recovered, *poses)) run.online.push_back(*entry);
    }
    if (!tracked.T_world_cam) continue;
    ++result.num_tracked;
    if (!result.first_frame) result.first_frame = frame->index;
    run.online.push_back({frame->index, frame->timestamp_s, tracked.map_id, *tracked.T_world_cam});
  }
  timed(run.thread_ms, [&] { static_cast<void>(tracker.Finish()); });
  return run;
}

}  // namespace

TrackingBenchResult BenchTracking(const TrackingBenchOptions& options) {
  options.source.Validate();
  options.tracking.Validate();
  const std::filesystem::path folder = std::filesystem::absolute(options.folder).lexically_normal();
  TrackingBenchResult result;
  result.name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  const auto source = OpenFrameSource(
      options.folder, ReadCameraFile((folder / "camera.yaml").string()), options.source);
  result.width = source->camera().width;
  result.height = source->camera().height;
  StageTimes times;
  const std::unique_ptr<Tracker> tracker = CreateTracker(options.tracking, &times);
  const double start_ms = ProcessCpuMs();
  const TrackedRun run = TrackAll(*source, *tracker, result);
  const double cpu_ms = ProcessCpuMs() - start_ms - run.read_ms;
  const double num_frames = std::max<double>(1, static_cast<double>(result.num_frames));
  result.cpu_ms_per_frame = cpu_ms / num_frames;
  result.thread_ms_per_frame = run.thread_ms / num_frames;
  for (const StageTime& stage : times.Snapshot()) {
    result.stages.push_back({stage.stage, stage.num_calls, stage.cpu_ms / num_frames});
  }
  const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
  result.num_with_pose = static_cast<std::int64_t>(trajectory.size());
  result.num_keyframes = static_cast<std::int64_t>(tracker->KeyframeTrajectory().size());
  std::map<int, int> maps;
  for (const TrajectoryEntry& entry : trajectory) ++maps[entry.map_id];
  result.num_maps = maps.size();
  CompareTracking(folder, options.mean_depth_m, trajectory, run.online, result);
  return result;
}

Table ToTable(const TrackingBenchResult& result) {
  Table table;
  table.title = "Tracking " + result.name + ", " + std::to_string(result.num_frames) +
                " frames of " + std::to_string(result.width) + " x " +
                std::to_string(result.height);
  table.columns = {"", ""};
  const auto add = [&](const std::string& name, const std::string& value) {
    table.rows.push_back({name, value});
  };
  const auto share = [&](std::int64_t count) {
    const double num_frames = std::max<double>(1, static_cast<double>(result.num_frames));
    return std::to_string(count) + " (" + FormatPercent(static_cast<double>(count) / num_frames) +
           ")";
  };
  add("frames with a pose in the end", share(result.num_with_pose));
  add("frames with a pose when they came", share(result.num_tracked));
  add("first of them", result.first_frame ? std::to_string(*result.first_frame) : "-");
  add("maps", std::to_string(result.num_maps));
  add("keyframes", std::to_string(result.num_keyframes));
  const auto add_error = [&](const std::string& name, const std::optional<double>& rmse_m) {
    if (rmse_m) add(name, FormatLength(*rmse_m, result.mean_depth_m));
  };
  add_error("RMSE of the final trajectory, m", result.final_rmse_m);
  add_error("RMSE of the online trajectory, m", result.online_rmse_m);
  if (result.final_rotation_deg) {
    add("RMSE of the final rotations, deg", FormatNumber(*result.final_rotation_deg, 3));
  }
  add("CPU of the process, ms a frame", FormatFixed(result.cpu_ms_per_frame, 2));
  add("CPU of the tracking thread, ms a frame", FormatFixed(result.thread_ms_per_frame, 2));
  add("CPU of the longest call, ms", FormatFixed(result.max_thread_ms, 1));
  for (const TrackingBenchStage& stage : result.stages) {
    add(stage.name + ", ms a frame (" + std::to_string(stage.num_calls) + " calls)",
        FormatFixed(stage.cpu_ms_per_frame, 2));
  }
  table.notes = {"Without reading the images. A stage that calls another counts its time too."};
  return table;
}

Json ToJson(const TrackingBenchResult& result) {
  Json json = {{"sequence", result.name},
               {"width_px", result.width},
               {"height_px", result.height},
               {"frames", result.num_frames},
               {"frames_with_pose", result.num_with_pose},
               {"frames_with_pose_online", result.num_tracked},
               {"maps", result.num_maps},
               {"keyframes", result.num_keyframes}};
  const auto add = [&](const char* name, const auto& value) {
    if (value) json[name] = *value;
  };
  add("first_frame", result.first_frame);
  add("final_rmse_m", result.final_rmse_m);
  add("online_rmse_m", result.online_rmse_m);
  add("final_rotation_rmse_deg", result.final_rotation_deg);
  add("mean_depth_m", result.mean_depth_m);
  json["cpu_ms_per_frame"] = result.cpu_ms_per_frame;
  json["thread_cpu_ms_per_frame"] = result.thread_ms_per_frame;
  json["max_thread_cpu_ms"] = result.max_thread_ms;
  for (const TrackingBenchStage& stage : result.stages) {
    json["stages"][stage.name] = {{"calls", stage.num_calls},
                                  {"cpu_ms_per_frame", stage.cpu_ms_per_frame}};
  }
  return json;
}

}  // namespace mono3d::tools
