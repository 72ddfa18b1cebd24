// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/cloud_part.h"

#include <algorithm>

#include "drawing/cloud_picture.h"
#include "evaluate/error_file.h"
#include "evaluate/trajectory_part.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/io/ply_file.h"

namespace mono3d::tools {
namespace {

constexpr double kMaxDistanceShown = 0.02;  // of the mean depth: end of the colour scale

Json RegistrationJson(const CloudRegistration& registration) {
  Json json = {{"status", mono3d::ToString(registration.status)}};
  if (!registration.reason.empty()) json["reason"] = registration.reason;
  json["iterations"] = registration.num_iterations;
  json["points"] = registration.num_points;
  json["inlier_share"] = registration.inlier_share;
  json["residual_m"] = registration.residual_m;
  json["free_motions"] = registration.num_free_motions;
  json["transformation"] = ToJson(registration.S_truth_estimate);
  return json;
}

std::vector<std::string> DistanceRow(const std::string& name, const ErrorStatistics& distances,
                                     std::optional<double> mean_depth_m) {
  return {name,
          FormatLength(distances.rmse, mean_depth_m),
          FormatNumber(distances.mean),
          FormatNumber(distances.median),
          FormatNumber(distances.sigma),
          FormatNumber(distances.max)};
}

Table DistanceTable(const ModelEvaluation& model) {
  const CloudError& error = model.cloud.error;
  Table table;
  table.title = model.mean_depth_m ? "Model: distances in metres (and in percent of the mean depth)"
                                   : "Model: distances in metres";
  table.columns = {"from, to", "RMSE", "mean", "median", "sigma", "max"};
  table.rows = {
      DistanceRow("model to truth, point", error.estimate_to_truth, model.mean_depth_m),
      DistanceRow("model to truth, plane", error.estimate_to_truth_plane, model.mean_depth_m),
      DistanceRow("truth to model, point", error.truth_to_estimate, model.mean_depth_m),
      DistanceRow("truth to model, plane", error.truth_to_estimate_plane, model.mean_depth_m)};
  table.notes = {"Spacing of the true cloud " + FormatNumber(error.truth_spacing_m, 3) +
                 " m, of the model " + FormatNumber(error.estimate_spacing_m, 3) +
                 " m: about half of it is a floor under the distances to points, not under those "
                 "to planes."};
  return table;
}

Table ShareTable(const ModelEvaluation& model) {
  Table table;
  table.title = "Model: shares within a distance";
  table.columns = {"within",       "accuracy", "completeness", "F-score", "to plane: accuracy",
                   "completeness", "F-score"};
  for (const CloudShares& shares : model.cloud.error.shares) {
    table.rows.push_back({FormatPercent(shares.threshold_m / *model.mean_depth_m) + " = " +
                              FormatNumber(shares.threshold_m, 3) + " m",
                          FormatPercent(shares.accuracy), FormatPercent(shares.completeness),
                          FormatPercent(shares.f_score), FormatPercent(shares.accuracy_to_plane),
                          FormatPercent(shares.completeness_to_plane),
                          FormatPercent(shares.f_score_to_plane)});
  }
  table.notes = {
      "Accuracy: share of the model near the truth. Completeness: share of the truth near the "
      "model. In percent of the mean depth."};
  return table;
}

enum class SurfelKind { kSure, kUnsure, kInferred };
constexpr SurfelKind kSurfelKinds[] = {SurfelKind::kSure, SurfelKind::kUnsure,
                                       SurfelKind::kInferred};

// By what models are exported with; a cloud without confidences is sure.
SurfelKind KindOf(const PointCloud& cloud, std::size_t i) {
  if (IsInferred(cloud, i)) return SurfelKind::kInferred;
  const bool is_sure = cloud.confidences.empty() ||
                       double(cloud.confidences[i]) >= SurfelExportOptions().min_confidence;
  return is_sure ? SurfelKind::kSure : SurfelKind::kUnsure;
}

std::string NameOfKind(SurfelKind kind) {
  switch (kind) {
    case SurfelKind::kSure:
      return "matched";
    case SurfelKind::kUnsure:
      return "matched, of a confidence below " +
             FormatNumber(SurfelExportOptions().min_confidence, 2);
    case SurfelKind::kInferred:
      return "inferred";
  }
  return {};
}

// What was matched, surely or not, and what was inferred, each by itself.
Table KindTable(const ModelEvaluation& model) {
  const CloudError& error = model.cloud.error;
  const PointCloud& estimate = model.cloud.estimate_in_truth;
  Table table;
  table.title = "Model: accuracy of what was matched and of what was inferred";
  table.columns = {"surfels", "number", "RMSE to plane, m"};
  for (const CloudShares& shares : error.shares) {
    table.columns.push_back("to plane, within " +
                            FormatPercent(shares.threshold_m / *model.mean_depth_m));
  }
  for (const SurfelKind kind : kSurfelKinds) {
    std::vector<double> distances_m;
    for (std::size_t i = 0; i < estimate.size(); ++i) {
      if (KindOf(estimate, i) == kind) distances_m.push_back(error.estimate_plane_distances_m[i]);
    }
    if (distances_m.empty()) continue;
    table.rows.push_back({NameOfKind(kind), std::to_string(distances_m.size()),
                          FormatNumber(ComputeStatistics(distances_m).rmse)});
    for (const CloudShares& shares : error.shares) {
      const auto near = std::ranges::count_if(
          distances_m, [&](double distance_m) { return distance_m <= shares.threshold_m; });
      table.rows.back().push_back(
          FormatPercent(static_cast<double>(near) / static_cast<double>(distances_m.size())));
    }
  }
  return table;
}

std::vector<std::string> StepRow(const std::string& name, const CloudRegistration& step,
                                 double start_scale) {
  return {name,
          std::to_string(step.num_iterations),
          FormatPercent(step.inlier_share),
          FormatNumber(step.residual_m),
          FormatPercent(step.S_truth_estimate.scale() / start_scale - 1, 3),
          step.converged() ? "converged" : step.reason};
}

Table RegistrationTable(const ModelEvaluation& model) {
  const CloudEvaluation& cloud = model.cloud;
  const double start_scale = cloud.rigid.S_truth_estimate.scale();
  Table table;
  table.title = "Model: registration to the truth";
  table.columns = {"step", "iterations", "inliers", "residual m", "change of scale", "result"};
  table.rows = {{model.start_is_known ? "1 from the trajectories" : "1 as the clouds lie", "-", "-",
                 FormatNumber(cloud.error_at_start.estimate_to_truth_plane.rmse), "-", "start"},
                StepRow("2 point-to-plane ICP", cloud.rigid, start_scale),
                StepRow("3 ICP with scale", cloud.with_scale, start_scale)};
  return table;
}

std::string FigureName(const ModelEvaluation& model, const std::string& kind) {
  std::string name = model.name + "_" + kind;
  for (char& c : name) c = c == ' ' ? '_' : c;
  return name;
}

std::vector<Figure> ModelFigures(const ModelEvaluation& model) {
  const PointCloud& estimate = model.cloud.estimate_in_truth;
  const CloudError& error = model.cloud.error;
  constexpr int kWidth_px = 800;
  const std::vector<CloudView> views = StandardCloudViews(model.truth, kWidth_px);
  const double largest_m = model.mean_depth_m ? kMaxDistanceShown * *model.mean_depth_m
                                              : 3 * error.estimate_to_truth_plane.rmse;
  const std::string sides = " from above and from two sides";
  return {{FigureName(model, "beside_truth"), "The model (left) beside the truth (right).",
           "The reconstructed model on the left and the true surface on the right," + sides + ".",
           CloudsSideBySide(estimate, model.truth, views)},
          {FigureName(model, "two_colours"),
           "Model yellow, truth blue; whichever lies nearer to the viewer is seen.",
           "Model in yellow and truth in blue in one picture," + sides + ".",
           CloudsInTwoColours(estimate, model.truth, views)},
          {FigureName(model, "by_distance"),
           "The model coloured by the distance of each point from the true surface.",
           "The model coloured by its distance from the truth," + sides + "; RMSE " +
               FormatNumber(error.estimate_to_truth_plane.rmse, 3) + " m.",
           CloudByDistance(estimate, error.estimate_plane_distances_m, largest_m, views,
                           model.mean_depth_m)}};
}

}  // namespace

ModelEvaluation EvaluateModel(const std::string& name, const std::filesystem::path& estimate,
                              const std::filesystem::path& truth,
                              const std::optional<Similarity>& S_truth_estimate,
                              std::optional<double> mean_depth_m) {
  ModelEvaluation model;
  model.name = name;
  model.mean_depth_m = mean_depth_m;
  model.start_is_known = S_truth_estimate.has_value();
  const PointCloud cloud = ReadPly(estimate);
  model.truth = ReadPly(truth);
  std::vector<double> thresholds_m;
  if (mean_depth_m) thresholds_m = CloudThresholds(*mean_depth_m);
  try {
    model.cloud =
        EvaluateCloud(cloud, model.truth, S_truth_estimate.value_or(Similarity{}), thresholds_m);
  } catch (const Error& error) {
    throw Error(ErrorParts{.what = error.what(),
                           .where = estimate.string() + " and " + truth.string(),
                           .expected = {},
                           .found = {}});
  }
  return model;
}

void WriteErrorsBeside(const std::filesystem::path& model_path, const ModelEvaluation& model) {
  WriteErrorFile(model_path.parent_path() / kErrorFileName, ReadPly(model_path),
                 model.cloud.error.estimate_plane_distances_m);
}

Json ToJson(const ModelEvaluation& model) {
  Json json = {{"start", model.start_is_known ? "trajectories" : "identity"},
               {"points", model.cloud.estimate_in_truth.size()},
               {"true_points", model.truth.size()}};
  const ErrorStatistics& distances = model.cloud.error.estimate_to_truth;
  if (model.mean_depth_m) json["rmse_of_mean_depth"] = distances.rmse / *model.mean_depth_m;
  json["error"] = ToJson(model.cloud.error);
  if (model.surface) json["whole_surface"] = ToJson(*model.surface);
  if (model.mesh) json["mesh"] = ToJson(*model.mesh);
  json["error_at_start"] = ToJson(model.cloud.error_at_start);
  json["rigid"] = RegistrationJson(model.cloud.rigid);
  json["with_scale"] = RegistrationJson(model.cloud.with_scale);
  return json;
}

Section ModelSection(const ModelEvaluation& model, bool with_pictures) {
  Section section;
  section.title = model.name == "model" ? "Model" : "Model, " + model.name;
  section.tables = {DistanceTable(model)};
  if (!model.cloud.error.shares.empty()) {
    section.tables.push_back(ShareTable(model));
    const Table kinds = KindTable(model);
    if (kinds.rows.size() > 1) section.tables.push_back(kinds);
  }
  if (model.surface) section.tables.push_back(SurfaceTable(*model.surface, model.mean_depth_m));
  if (model.mesh) {
    for (Table& table :
         MeshTables(*model.mesh, {model.cloud.estimate_in_truth, model.cloud.error, model.surface},
                    model.mean_depth_m)) {
      section.tables.push_back(std::move(table));
    }
  }
  section.tables.push_back(RegistrationTable(model));
  if (with_pictures) section.figures = ModelFigures(model);
  return section;
}

Evaluation EvaluateCloudFiles(const CloudArguments& arguments, bool with_pictures) {
  RequireOption(arguments.mean_depth_m >= 0, "mean-depth", "a length in metres, 0: not known",
                arguments.mean_depth_m);
  if (arguments.estimate_trajectory.empty() != arguments.truth_trajectory.empty()) {
    throw UsageError("--est-trajectory and --truth-trajectory go together");
  }
  std::optional<Similarity> S_truth_estimate;
  if (!arguments.estimate_trajectory.empty()) {
    const TrajectoryEvaluation trajectory =
        EvaluateTrajectory("estimate", arguments.estimate_trajectory,
                           ReadAnyTrajectory(arguments.truth_trajectory), {}, arguments.trajectory);
    S_truth_estimate = trajectory.error.S_truth_estimate;
  }
  const std::optional<double> mean_depth_m =
      arguments.mean_depth_m > 0 ? std::optional(arguments.mean_depth_m) : std::nullopt;
  const ModelEvaluation model =
      EvaluateModel("model", arguments.estimate, arguments.truth, S_truth_estimate, mean_depth_m);
  Evaluation evaluation;
  evaluation.page.title = "Model";
  evaluation.page.subtitle = arguments.estimate + " against " + arguments.truth;
  evaluation.page.sections = {ModelSection(model, with_pictures)};
  evaluation.json = RecordOf("cloud", arguments.estimate, arguments.truth);
  if (mean_depth_m) evaluation.json["mean_depth_m"] = *mean_depth_m;
  evaluation.json["model"] = ToJson(model);
  return evaluation;
}

}  // namespace mono3d::tools
