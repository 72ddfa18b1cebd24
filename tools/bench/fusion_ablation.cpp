// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/fusion_ablation.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "bench/recorded_fusion.h"
#include "evaluate/depth_part.h"
#include "evaluate/files.h"
#include "evaluate/surface_part.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_registration.h"
#include "mono3d/evaluation/cloud_transform.h"
#include "mono3d/evaluation/trajectory_error.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

struct FusionTruth {
  std::vector<StampedPose> poses;
  double mean_depth_m = 0;
  PointCloud cloud;
  SequenceSurface surface;
};

FusionTruth ReadFusionTruth(const std::string& folder) {
  const SequenceFiles files = FindSequenceFiles(folder);
  const auto require = [&folder](bool holds, const std::string& what) {
    if (!holds) throw Error(ErrorParts{what, folder, "", ""});
  };
  require(!files.groundtruth.empty(), "no true poses in the sequence");
  require(!files.cloud.empty(), "no true cloud in the sequence");
  FusionTruth truth;
  truth.poses = ReadTrajectory(files.groundtruth);
  const std::optional<MeanDepth> mean_depth = FindMeanDepth(files.depth, {});
  require(mean_depth.has_value(), "no true depth in the sequence");
  truth.mean_depth_m = mean_depth->metres;
  truth.cloud = ReadPly(files.cloud);
  truth.surface = ReadSequenceSurface(files, truth.poses, truth.cloud, {});
  return truth;
}

// The paper's three steps, then against all that the frames show.
FusionFigures CompareModel(const FusedRun& run, const FusionTruth& truth) {
  FusionFigures figures;
  figures.num_maps = run.num_maps;
  figures.num_fused = run.num_fused;
  figures.num_moved = run.num_moved;
  figures.cpu_ms = run.cpu_ms;
  const TrajectoryError trajectory = CompareTrajectories(run.poses, truth.poses);
  figures.trajectory_rmse = trajectory.position.rmse / truth.mean_depth_m;
  const CloudRegistration rigid =
      RegisterCloudRigidly(run.model, truth.cloud, trajectory.S_truth_estimate);
  const CloudRegistration registration =
      RegisterCloud(run.model, truth.cloud, rigid.S_truth_estimate);
  const std::vector<double> thresholds_m = {0.01 * truth.mean_depth_m};
  const SurfaceEvaluation model = EvaluateSurface(
      TransformCloud(registration.S_truth_estimate, run.model), truth.surface, thresholds_m);
  figures.model_rmse = model.error.estimate_to_truth.rmse / truth.mean_depth_m;
  figures.accuracy = model.seen[0].accuracy;
  figures.completeness = model.seen[0].completeness;
  figures.f_score = model.seen[0].f_score;
  return figures;
}

std::vector<FusionVariant> ChosenFusionVariants(const FusionAblationOptions& options) {
  std::vector<FusionVariant> all = FusionVariants(options.pipeline.fusion);
  if (options.only.empty()) return all;
  std::vector<FusionVariant> chosen = {all.front()};
  for (const std::string& name : options.only) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& v) { return v.name == name; });
    if (found == all.end()) {
      std::string names;
      for (const FusionVariant& variant : all) names += (names.empty() ? "" : "; ") + variant.name;
      throw UsageError(ErrorParts{"no such variant", "--only", names, name});
    }
    if (found != all.begin()) chosen.push_back(*found);
  }
  return chosen;
}

}  // namespace

std::vector<FusionVariant> FusionVariants(const SurfelMapOptions& fusion) {
  std::vector<FusionVariant> variants = {{"as it is", fusion}};
  const auto add = [&](const std::string& name, const auto& change) {
    variants.push_back({name, fusion});
    change(variants.back().fusion);
  };
  add("no registration", [](SurfelMapOptions& o) { o.registration.enabled = false; });
  add("registration always", [](SurfelMapOptions& o) { o.registration.max_misfit = 0; });
  add("registration always, SE(3)", [](SurfelMapOptions& o) {
    o.registration.max_misfit = 0;
    o.registration.with_scale = false;
  });
  add("no confidence", [](SurfelMapOptions& o) { o.with_confidence = false; });
  const std::size_t num_exchanged = variants.size();
  for (std::size_t i = 0; i < num_exchanged; ++i) {
    // The misfit decides which of two poses to take: it has no say where one is always taken.
    if (variants[i].name == "registration always, SE(3)") continue;
    variants.push_back({"worse poses: " + variants[i].name, variants[i].fusion, true});
  }
  FusionVariant worse_rigid = {"worse poses: SE(3)", fusion, true};
  worse_rigid.fusion.registration.with_scale = false;
  variants.push_back(worse_rigid);
  return variants;
}

FusionFigures MeanFigures(const std::vector<FusionFigures>& figures) {
  FusionFigures mean;
  for (const FusionFigures& f : figures) {
    mean.num_maps += f.num_maps;
    mean.num_fused += f.num_fused;
    mean.num_moved += f.num_moved;
    const double share = 1.0 / static_cast<double>(figures.size());
    mean.trajectory_rmse += share * f.trajectory_rmse;
    mean.model_rmse += share * f.model_rmse;
    mean.accuracy += share * f.accuracy;
    mean.completeness += share * f.completeness;
    mean.f_score += share * f.f_score;
    mean.cpu_ms += share * f.cpu_ms;
  }
  return mean;
}

FusionAblationResult RunFusionAblation(const FusionAblationOptions& options,
                                       const DeviceOptions& device_options) {
  const std::vector<FusionVariant> variants = ChosenFusionVariants(options);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  FusionAblationResult result;
  result.device = Info(*device).name;
  result.pose_error = options.pose_error;
  for (const FusionVariant& variant : variants) result.rows.push_back({variant.name, {}});
  for (const std::string& folder : options.folders) {
    result.sequences.push_back(NameOfFolder(folder));
    const FusionTruth truth = ReadFusionTruth(folder);
    const std::vector<FusionEvent> events = RecordFusion(folder, options.pipeline, device);
    const std::vector<FusionEvent> worse = WithPoseErrors(events, options.pose_error);
    for (std::size_t i = 0; i < variants.size(); ++i) {
      const auto model = CreateSurfelMap(device, variants[i].fusion);
      const FusedRun run = FuseAgain(variants[i].has_pose_errors ? worse : events, *model,
                                     options.pipeline.surfel_export);
      result.rows[i].sequences.push_back(CompareModel(run, truth));
    }
  }
  return result;
}

}  // namespace mono3d::tools
