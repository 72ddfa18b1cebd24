// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/fusion_ablation.h"

namespace mono3d::tools {
namespace {

constexpr int kDecimals = 3;

Json ToJson(const FusionFigures& figures) {
  return {{"maps", figures.num_maps},
          {"fused", figures.num_fused},
          {"moved", figures.num_moved},
          {"trajectory_rmse_of_mean_depth", figures.trajectory_rmse},
          {"model_rmse_of_mean_depth", figures.model_rmse},
          {"accuracy", figures.accuracy},
          {"completeness_of_seen", figures.completeness},
          {"f_score_of_seen", figures.f_score},
          {"cpu_ms", figures.cpu_ms}};
}

Table BySequence(const FusionAblationResult& result, const std::string& title,
                 double FusionFigures::*figure) {
  Table table;
  table.title = title;
  table.columns = {""};
  table.columns.insert(table.columns.end(), result.sequences.begin(), result.sequences.end());
  for (const FusionAblationRow& row : result.rows) {
    table.rows.push_back({row.name});
    for (const FusionFigures& figures : row.sequences) {
      table.rows.back().push_back(FormatPercent(figures.*figure, kDecimals));
    }
  }
  return table;
}

}  // namespace

std::vector<Table> ToTables(const FusionAblationResult& result) {
  Table means;
  means.title = "What registration and confidence buy, on " + result.device;
  means.columns = {"",         "fused",        "moved",   "trajectory RMSE", "model RMSE",
                   "accuracy", "completeness", "F-score", "CPU ms"};
  for (const FusionAblationRow& row : result.rows) {
    const FusionFigures mean = MeanFigures(row.sequences);
    means.rows.push_back(
        {row.name, FormatFixed(mean.num_fused, 0) + " of " + FormatFixed(mean.num_maps, 0),
         FormatFixed(mean.num_moved, 0), FormatPercent(mean.trajectory_rmse, kDecimals),
         FormatPercent(mean.model_rmse, kDecimals), FormatPercent(mean.accuracy, 2),
         FormatPercent(mean.completeness, 2), FormatPercent(mean.f_score, 2),
         FormatFixed(mean.cpu_ms, 0)});
  }
  means.notes = {
      "Means over " + std::to_string(result.sequences.size()) +
      " sequences, errors in percent of the mean depth. Moved: fused depth maps that are not where "
      "the tracker had them. Trajectory: of the fused depth maps. Model: against all of the true "
      "surface that the frames show; completeness and F-score within 1 % of the depth, of what 5 "
      "frames see. Worse poses: each keyframe off by " +
      FormatPercent(result.pose_error, 2) + " of the depth. CPU: of the process, for one map."};
  return {means, BySequence(result, "Trajectory RMSE by sequence", &FusionFigures::trajectory_rmse),
          BySequence(result, "Model RMSE by sequence", &FusionFigures::model_rmse),
          BySequence(result, "F-score by sequence", &FusionFigures::f_score)};
}

Json ToJson(const FusionAblationResult& result) {
  Json json = {{"device", result.device},
               {"pose_error", result.pose_error},
               {"sequences", result.sequences}};
  json["variants"] = Json::array();
  for (const FusionAblationRow& row : result.rows) {
    Json variant = {{"name", row.name}, {"mean", ToJson(MeanFigures(row.sequences))}};
    for (std::size_t i = 0; i < row.sequences.size(); ++i) {
      variant["sequences"][result.sequences[i]] = ToJson(row.sequences[i]);
    }
    json["variants"].push_back(variant);
  }
  return json;
}

}  // namespace mono3d::tools
