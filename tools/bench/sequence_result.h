// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace mono3d::tools {

using Json = nlohmann::ordered_json;

// Errors of positions or distances, as shares of the sequence's mean depth.
struct LengthErrors {
  std::optional<double> rmse;
  std::optional<double> mean;  // the paper's MAE
  std::optional<double> sigma;
};

// The figures of one sequence that the tables show. Absent: not known, or nothing to compare with.
struct SequenceResult {
  std::string name;
  bool is_success = false;
  std::string reason;  // why not

  std::optional<double> mean_depth_m;
  double num_frames = 0;
  double tracked_share = 0;       // frames in the trajectory of the first map by all
  LengthErrors model_trajectory;  // after registration with the model: frames with a depth map
  LengthErrors final_trajectory;  // every tracked frame
  std::optional<double> model_rotation_rmse_deg;
  std::optional<double> final_rotation_rmse_deg;
  std::optional<double> depth_rmse;  // share of the mean depth
  std::optional<double> depth_l1_rel;
  std::optional<double> delta_125;
  std::optional<double> delta_105;
  std::optional<double> density;
  LengthErrors model;                  // point to nearest point of the truth
  std::optional<double> completeness;  // share of the truth within 1 % of the mean depth
  // Against all of the true surface that the frames show; the latter two at 1 % of the mean depth,
  // over what at least five frames see.
  std::optional<double> surface_rmse;
  std::optional<double> seen_completeness;
  std::optional<double> seen_f_score;
  std::optional<double> frames_per_s;
  std::optional<double> cpu_ms_per_frame;
  std::optional<double> ms_per_depth_map;
  std::optional<double> share_of_frames_used;  // for depth
  std::optional<double> wall_s;
  std::optional<double> cpu_s;
};

// When is a sequence a success? The paper: when the registration of the depth maps does not fail
// and the trajectory is usable. Here, in numbers: the run ended in order and made a model; the
// trajectory of one map holds at least half of the frames; no error exceeds 5 % of the mean depth:
// RMSE of the trajectory of all frames, of the trajectory after registration, and of the model; and
// the RMSE of the orientations of either trajectory is at most 5 degrees (positions along a
// straight line fit even where every view looks the wrong way). Each where there is a truth for it.
inline constexpr double kMinTrackedShare = 0.5;
inline constexpr double kMaxRmse = 0.05;
inline constexpr double kMaxRotationRmseDeg = 5;
std::string SuccessRule();

// Takes the figures from the records that mono3d-reconstruct (run.json) and mono3d-evaluate
// (evaluation.json) wrote, and judges them.
SequenceResult ReadSequenceResult(const std::string& name, const Json& run, const Json& evaluation);

// A sequence that did not come that far.
SequenceResult FailedSequence(const std::string& name, const std::string& reason);

Json ToJson(const SequenceResult& result);

}  // namespace mono3d::tools
