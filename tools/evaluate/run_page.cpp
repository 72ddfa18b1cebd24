// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/run_comparison.h"
#include "evaluate/run_record.h"

namespace mono3d::tools {
namespace {

std::vector<KeyFigure> KeyFigures(const Comparison& comparison) {
  std::vector<KeyFigure> keys;
  for (const TrajectoryEvaluation& trajectory : comparison.trajectories) {
    if (trajectory.name != "final") continue;
    const ErrorStatistics& position = trajectory.error.position;
    const std::string metres = FormatNumber(position.rmse, 3) + " m";
    const auto depth_m = comparison.mean_depth_m;
    keys.push_back({"Truth covered", FormatPercent(trajectory.error.truth_coverage),
                    std::to_string(trajectory.error.poses.size()) + " frames tracked"});
    keys.push_back({"Trajectory RMSE",
                    depth_m ? FormatPercent(position.rmse / *depth_m, 3) : metres,
                    depth_m ? "of the depth, " + metres : "final, every frame"});
  }
  if (comparison.depth && comparison.depth->mean.num_maps_compared > 0) {
    const DepthError& mean = comparison.depth->mean.mean;
    keys.push_back({"Depth L1-rel", FormatPercent(mean.l1_rel, 2),
                    "delta 1.05: " + FormatFixed(mean.delta_105, 4)});
    keys.push_back({"Depth density", FormatPercent(mean.density), "of the pixels with a truth"});
  }
  if (!comparison.models.empty()) {
    const CloudError& error = comparison.models[0].cloud.error;
    const double rmse_m = error.estimate_to_truth.rmse;
    const auto depth_m = comparison.mean_depth_m;
    const std::string metres = FormatNumber(rmse_m, 3) + " m";
    keys.push_back({"Model RMSE", depth_m ? FormatPercent(rmse_m / *depth_m, 3) : metres,
                    depth_m ? "of the depth, " + metres : "point to point"});
    if (error.shares.size() > 1) {
      keys.push_back({"Model F-score", FormatPercent(error.shares[1].f_score), "at 1 % of depth"});
    }
  }
  return keys;
}

std::string MeanDepthText(const Comparison& comparison) {
  if (comparison.arguments.mean_depth_m > 0) {
    return "mean depth " + FormatNumber(*comparison.mean_depth_m) + " m, as given";
  }
  if (!comparison.mean_depth) return "mean depth not known";
  return "mean depth " + FormatNumber(comparison.mean_depth->metres) + " m, over " +
         std::to_string(comparison.mean_depth->num_maps) + " true depth maps";
}

Section TrajectoryPart(const Comparison& comparison, bool with_pictures) {
  Section section = TrajectorySection(comparison.trajectories, comparison.arguments.trajectory,
                                      comparison.mean_depth_m);
  if (!with_pictures) return section;
  for (const TrajectoryEvaluation& trajectory : comparison.trajectories) {
    if (trajectory.name.starts_with("online")) continue;  // hardly to be told from the final one
    section.figures.push_back(TrajectoryFigure(trajectory, comparison.truth));
  }
  return section;
}

}  // namespace

Json MakeJson(const Comparison& comparison) {
  Json json = RecordOf("run", comparison.arguments.run, comparison.arguments.sequence);
  json["images"] = comparison.sequence.images.size();
  if (comparison.mean_depth_m) json["mean_depth_m"] = *comparison.mean_depth_m;
  if (comparison.mean_depth) json["mean_depth_maps"] = comparison.mean_depth->num_maps;
  for (const TrajectoryEvaluation& trajectory : comparison.trajectories) {
    json["trajectory"][trajectory.name] = ToJson(trajectory.error, comparison.mean_depth_m);
  }
  if (comparison.depth) json.update(ToJson(*comparison.depth));
  for (const ModelEvaluation& model : comparison.models) {
    json["model"][model.name] = ToJson(model);
  }
  json["left_out"] = comparison.left_out;
  return json;
}

Page MakePage(const Comparison& comparison, bool with_pictures) {
  Page page;
  const std::filesystem::path sequence(comparison.arguments.sequence);
  page.title = (sequence.has_filename() ? sequence : sequence.parent_path()).filename().string();
  page.subtitle = comparison.arguments.run + ", " + MeanDepthText(comparison);
  page.key_figures = KeyFigures(comparison);
  if (!comparison.trajectories.empty()) {
    page.sections.push_back(TrajectoryPart(comparison, with_pictures));
  }
  for (std::size_t i = 0; i < comparison.models.size(); ++i) {
    page.sections.push_back(ModelSection(comparison.models[i], with_pictures && i == 0));
  }
  if (comparison.depth) {
    for (Section& section : DepthSections(*comparison.depth, with_pictures)) {
      page.sections.push_back(std::move(section));
    }
  }
  if (!comparison.record.is_null()) page.sections.push_back(RecordSection(comparison.record));
  if (!comparison.left_out.empty()) {
    Section left_out;
    left_out.title = "Left out";
    for (const std::string& reason : comparison.left_out) {
      left_out.paragraphs.push_back("left out: " + reason);
    }
    page.sections.push_back(left_out);
  }
  return page;
}

}  // namespace mono3d::tools
