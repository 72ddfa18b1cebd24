// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/run_part.h"

#include "evaluate/run_comparison.h"
#include "evaluate/run_record.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d::tools {
namespace {

// Runs `part`; if it fails, says so and goes on.
template <typename Part>
void Try(Comparison& comparison, const std::string& name, const Part& part) {
  try {
    part();
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    comparison.left_out.push_back(name + ": " + error.what());
  }
}

std::string NameOf(const RunMapFiles& map, const std::string& kind) {
  return map.suffix.empty() ? kind : kind + " " + map.suffix.substr(1);
}

// The alignment of this map's final trajectory, else of its model's trajectory.
std::optional<Similarity> AlignmentOf(const Comparison& comparison, const RunMapFiles& map) {
  for (const char* kind : {"final", "model"}) {
    for (const TrajectoryEvaluation& trajectory : comparison.trajectories) {
      if (trajectory.name == NameOf(map, kind)) return trajectory.error.S_truth_estimate;
    }
  }
  return std::nullopt;
}

void CompareTrajectoryFiles(Comparison& comparison) {
  if (comparison.sequence.groundtruth.empty()) {
    comparison.left_out.emplace_back("trajectory: the sequence has no groundtruth.txt");
    return;
  }
  TrajectoryTimes times;
  if (!comparison.sequence.timestamps.empty()) {
    times.timestamps_s = ReadTimestamps(comparison.sequence.timestamps);
  }
  comparison.truth = ReadAnyTrajectory(comparison.sequence.groundtruth, times);
  for (const RunMapFiles& map : comparison.run.maps) {
    const std::pair<const char*, const std::filesystem::path*> kinds[] = {
        {"final", &map.trajectory},
        {"online", &map.trajectory_online},
        {"model", &map.model_trajectory}};
    for (const auto& [kind, path] : kinds) {
      const std::string name = NameOf(map, kind);
      if (path->empty()) continue;
      Try(comparison, name + " trajectory", [&, &path = path] {
        comparison.trajectories.push_back(
            EvaluateTrajectory(name, *path, comparison.truth, {}, comparison.arguments.trajectory));
      });
    }
  }
}

void CompareDepthMaps(Comparison& comparison) {
  if (comparison.sequence.depth.empty()) {
    comparison.left_out.emplace_back(
        "depth, confidence, normals: the sequence has no true depth maps (depth/)");
    return;
  }
  if (comparison.run.depth.empty()) {
    comparison.left_out.emplace_back(
        "depth, confidence, normals: the run has no depth maps (depth/): none was estimated, or it "
        "was made with --depth-files none");
    return;
  }
  const auto find = [](const FilesByFrame& files, std::int64_t frame) {
    const auto found = files.find(frame);
    return found == files.end() ? std::filesystem::path{} : found->second;
  };
  std::vector<DepthFiles> pairs;
  for (const auto& [frame, path] : comparison.run.depth) {
    const std::filesystem::path truth =
        find(comparison.sequence.depth, NumberOfImage(comparison.sequence, frame));
    if (truth.empty()) continue;
    pairs.push_back({frame, path, truth, find(comparison.run.confidence, frame),
                     find(comparison.run.normal, frame)});
  }
  if (pairs.empty()) {
    comparison.left_out.push_back("depth: none of the run's " +
                                  std::to_string(comparison.run.depth.size()) +
                                  " depth maps is of a frame with a true one");
    return;
  }
  std::optional<CameraModel> camera;
  if (!comparison.sequence.camera.empty()) camera = ReadCameraFile(comparison.sequence.camera);
  Try(comparison, "depth",
      [&] { comparison.depth = EvaluateDepthMaps(pairs, comparison.arguments.depth, camera); });
}

// Against all that the sequence shows, where its true poses and its camera are known.
void CompareSurfaces(Comparison& comparison) {
  if (comparison.models.empty() || !comparison.mean_depth_m) return;
  Try(comparison, "model, of what the frames see", [&] {
    const SequenceSurface surface =
        ReadSequenceSurface(comparison.sequence, comparison.truth, comparison.models[0].truth,
                            comparison.arguments.depth);
    const std::vector<double> thresholds_m = CloudThresholds(*comparison.mean_depth_m);
    for (ModelEvaluation& model : comparison.models) {
      model.surface = EvaluateSurface(model.cloud.estimate_in_truth, surface, thresholds_m);
      if (!model.mesh) continue;
      model.mesh->surface = EvaluateSurface(model.mesh->samples_in_truth, surface, thresholds_m);
    }
  });
}

// To the last one of the models, of which it was made.
void AddMesh(Comparison& comparison, const std::filesystem::path& mesh) {
  ModelEvaluation& model = comparison.models.back();
  std::vector<double> thresholds_m;
  if (model.mean_depth_m) thresholds_m = CloudThresholds(*model.mean_depth_m);
  model.mesh = EvaluateMesh(mesh, model.cloud.estimate_in_truth, model.cloud.S_truth_estimate,
                            model.truth, thresholds_m);
}

void CompareModels(Comparison& comparison) {
  if (comparison.sequence.cloud.empty()) {
    comparison.left_out.emplace_back("model: the sequence has no cloud.ply");
    return;
  }
  if (!comparison.mean_depth_m) {
    comparison.left_out.emplace_back(
        "model, shares within a distance: the mean depth is not known (--mean-depth)");
  }
  for (const RunMapFiles& map : comparison.run.maps) {
    const std::string name = NameOf(map, "model");
    if (map.model.empty()) {
      comparison.left_out.push_back(name + ": the run made none");
      continue;
    }
    const std::optional<Similarity> S_truth_estimate = AlignmentOf(comparison, map);
    if (!S_truth_estimate) {
      comparison.left_out.push_back(name + ": no trajectory to begin its registration with");
      continue;
    }
    Try(comparison, name, [&] {
      comparison.models.push_back(EvaluateModel(name, map.model, comparison.sequence.cloud,
                                                S_truth_estimate, comparison.mean_depth_m));
      // Of the map that mono3d-view shows.
      if (map.suffix.empty()) WriteErrorsBeside(map.model, comparison.models.back());
      if (map.mesh.empty()) return;
      Try(comparison, NameOf(map, "mesh"), [&] { AddMesh(comparison, map.mesh); });
    });
  }
}

void FindMeanDepth(Comparison& comparison) {
  if (comparison.arguments.mean_depth_m > 0) {
    comparison.mean_depth_m = comparison.arguments.mean_depth_m;
  } else if (!comparison.sequence.depth.empty()) {
    comparison.mean_depth = FindMeanDepth(comparison.sequence.depth, comparison.arguments.depth);
    if (comparison.mean_depth) comparison.mean_depth_m = comparison.mean_depth->metres;
  }
}

}  // namespace

Evaluation EvaluateRun(const RunArguments& arguments, bool with_pictures) {
  arguments.trajectory.Validate();
  arguments.depth.Validate();
  RequireOption(arguments.mean_depth_m >= 0, "mean-depth", "a length in metres, 0: not known",
                arguments.mean_depth_m);
  Comparison comparison = {.arguments = arguments,
                           .run = FindRunFiles(arguments.run),
                           .sequence = FindSequenceFiles(arguments.sequence)};
  if (!comparison.run.record.empty()) comparison.record = ReadRecord(comparison.run.record);
  FindMeanDepth(comparison);
  CompareTrajectoryFiles(comparison);
  CompareDepthMaps(comparison);
  CompareModels(comparison);
  CompareSurfaces(comparison);
  if (comparison.trajectories.empty() && !comparison.depth && comparison.models.empty()) {
    throw Error(ErrorParts{.what = "nothing can be compared",
                           .where = arguments.run + " and " + arguments.sequence,
                           .expected = {},
                           .found = comparison.left_out.empty() ? "" : comparison.left_out[0]});
  }
  return {MakePage(comparison, with_pictures), MakeJson(comparison)};
}

}  // namespace mono3d::tools
