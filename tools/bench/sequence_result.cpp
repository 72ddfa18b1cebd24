// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/sequence_result.h"

#include <array>
#include <utility>

#include "report/table.h"

namespace mono3d::tools {
namespace {

std::optional<double> Number(const Json& json, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
  return json.at(at).get<double>();
}

std::optional<double> Ratio(std::optional<double> numerator, std::optional<double> denominator,
                            double factor = 1) {
  if (!numerator || !denominator || *denominator <= 0) return std::nullopt;
  return factor * *numerator / *denominator;
}

LengthErrors ReadErrors(const Json& evaluation, const std::string& pointer,
                        std::optional<double> mean_depth_m) {
  return {Ratio(Number(evaluation, pointer + "/rmse"), mean_depth_m),
          Ratio(Number(evaluation, pointer + "/mean"), mean_depth_m),
          Ratio(Number(evaluation, pointer + "/sigma"), mean_depth_m)};
}

// The share within 1 % of the mean depth: the second of the thresholds 0.5, 1 and 2 %.
std::optional<double> ReadCompleteness(const Json& evaluation) {
  return Number(evaluation, "/model/model/error/shares/1/completeness");
}

std::string TooLarge(const std::string& what, std::optional<double> rmse) {
  if (!rmse || *rmse <= kMaxRmse) return {};
  return what + " is off by " + FormatPercent(*rmse) + " of the mean depth";
}

std::string WhyNot(const SequenceResult& result, const Json& run) {
  if (run.value("end", "") != "finished") return "the run ended early: " + run.value("error", "");
  if (Number(run, "/maps/0/surfels").value_or(0) <= 0) return "no model";
  if (result.tracked_share < kMinTrackedShare) {
    return "only " + FormatPercent(result.tracked_share) + " of the frames tracked in one map";
  }
  for (const auto& [what, rmse] :
       {std::pair("the trajectory", result.final_trajectory.rmse),
        std::pair("the trajectory after registration", result.model_trajectory.rmse),
        std::pair("the model", result.model.rmse)}) {
    std::string reason = TooLarge(what, rmse);
    if (!reason.empty()) return reason;
  }
  for (const auto& [what, rmse_deg] :
       {std::pair("the trajectory", result.final_rotation_rmse_deg),
        std::pair("the trajectory after registration", result.model_rotation_rmse_deg)}) {
    if (!rmse_deg || *rmse_deg <= kMaxRotationRmseDeg) continue;
    return std::string(what) + " is turned by " + FormatNumber(*rmse_deg, 3) + " degrees";
  }
  return {};
}

void Put(Json& json, const std::string& name, std::optional<double> value) {
  json[name] = value ? Json(*value) : Json();
}

Json ToJson(const LengthErrors& errors) {
  Json json;
  Put(json, "rmse", errors.rmse);
  Put(json, "mean", errors.mean);
  Put(json, "sigma", errors.sigma);
  return json;
}

}  // namespace

std::string SuccessRule() {
  return "A success: the run ended in order and made a model, one map holds at least " +
         FormatPercent(kMinTrackedShare, 0) +
         " of the frames, and the RMSE of both trajectories and of the model is at most " +
         FormatPercent(kMaxRmse, 0) + " of the mean depth and that of the orientations " +
         FormatNumber(kMaxRotationRmseDeg, 2) +
         " degrees, each where there is a truth for it. Failures are counted and left out of the "
         "means, as in the paper.";
}

SequenceResult ReadSequenceResult(const std::string& name, const Json& run,
                                  const Json& evaluation) {
  SequenceResult result;
  result.name = name;
  result.mean_depth_m = Number(evaluation, "/mean_depth_m");
  const std::optional<double> frames = Number(run, "/counts/frames");
  result.num_frames = frames.value_or(0);
  result.tracked_share = Ratio(Number(run, "/maps/0/frames"), frames).value_or(0);
  result.model_trajectory =
      ReadErrors(evaluation, "/trajectory/model/position_m", result.mean_depth_m);
  result.final_trajectory =
      ReadErrors(evaluation, "/trajectory/final/position_m", result.mean_depth_m);
  result.model_rotation_rmse_deg = Number(evaluation, "/trajectory/model/rotation_deg/rmse");
  result.final_rotation_rmse_deg = Number(evaluation, "/trajectory/final/rotation_deg/rmse");
  result.depth_rmse = Ratio(Number(evaluation, "/depth/mean/rmse_m"), result.mean_depth_m);
  result.depth_l1_rel = Number(evaluation, "/depth/mean/l1_rel");
  result.delta_125 = Number(evaluation, "/depth/mean/delta_1.25");
  result.delta_105 = Number(evaluation, "/depth/mean/delta_1.05");
  result.density = Number(evaluation, "/depth/mean/density");
  result.model =
      ReadErrors(evaluation, "/model/model/error/estimate_to_truth_m", result.mean_depth_m);
  result.completeness = ReadCompleteness(evaluation);
  const std::string surface = "/model/model/whole_surface";
  result.surface_rmse =
      Ratio(Number(evaluation, surface + "/estimate_to_truth_m/rmse"), result.mean_depth_m);
  result.seen_completeness = Number(evaluation, surface + "/shares/1/completeness_of_seen");
  result.seen_f_score = Number(evaluation, surface + "/shares/1/f_score_of_seen");
  result.wall_s = Number(run, "/times/wall_s");
  result.cpu_s = Number(run, "/times/cpu_s");
  result.frames_per_s = Ratio(frames, result.wall_s);
  result.cpu_ms_per_frame = Ratio(result.cpu_s, frames, 1e3);
  result.ms_per_depth_map = Ratio(Number(run, "/stages/depth~1estimate/wall_ms"),
                                  Number(run, "/stages/depth~1estimate/calls"));
  result.share_of_frames_used = Ratio(Number(run, "/counts/depth_maps"), frames);
  result.reason = WhyNot(result, run);
  result.is_success = result.reason.empty();
  return result;
}

SequenceResult FailedSequence(const std::string& name, const std::string& reason) {
  SequenceResult result;
  result.name = name;
  result.reason = reason;
  return result;
}

Json ToJson(const SequenceResult& result) {
  Json json = {{"sequence", result.name}, {"success", result.is_success}};
  if (!result.is_success) json["reason"] = result.reason;
  Put(json, "mean_depth_m", result.mean_depth_m);
  json["frames"] = result.num_frames;
  json["tracked_share"] = result.tracked_share;
  json["model_trajectory_of_mean_depth"] = ToJson(result.model_trajectory);
  json["final_trajectory_of_mean_depth"] = ToJson(result.final_trajectory);
  json["model_of_mean_depth"] = ToJson(result.model);
  const std::array<std::pair<const char*, std::optional<double>>, 17> values = {
      {{"final_rotation_rmse_deg", result.final_rotation_rmse_deg},
       {"model_rotation_rmse_deg", result.model_rotation_rmse_deg},
       {"depth_rmse_of_mean_depth", result.depth_rmse},
       {"depth_l1_rel", result.depth_l1_rel},
       {"delta_1.25", result.delta_125},
       {"delta_1.05", result.delta_105},
       {"density", result.density},
       {"model_completeness_at_1_percent", result.completeness},
       {"model_surface_rmse_of_mean_depth", result.surface_rmse},
       {"model_seen_completeness_at_1_percent", result.seen_completeness},
       {"model_seen_f_score_at_1_percent", result.seen_f_score},
       {"frames_per_s", result.frames_per_s},
       {"cpu_ms_per_frame", result.cpu_ms_per_frame},
       {"ms_per_depth_map", result.ms_per_depth_map},
       {"share_of_frames_used", result.share_of_frames_used},
       {"wall_s", result.wall_s},
       {"cpu_s", result.cpu_s}}};
  for (const auto& [name, value] : values) Put(json, name, value);
  return json;
}

}  // namespace mono3d::tools
