// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/trajectory_part.h"

#include "drawing/trajectory_picture.h"
#include "mono3d/core/error.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d::tools {
namespace {

std::vector<std::string> PositionRow(const TrajectoryEvaluation& trajectory,
                                     std::optional<double> mean_depth_m) {
  const TrajectoryError& error = trajectory.error;
  const ErrorStatistics& position = error.position;
  return {trajectory.name,
          std::to_string(error.num_estimated),
          std::to_string(error.poses.size()),
          FormatPercent(error.truth_coverage),
          FormatLength(position.rmse, mean_depth_m),
          FormatNumber(position.mean),
          FormatNumber(position.median),
          FormatNumber(position.sigma),
          FormatNumber(position.max)};
}

std::vector<std::string> RotationRow(const TrajectoryEvaluation& trajectory) {
  const TrajectoryError& error = trajectory.error;
  const bool has_segments = error.relative_position.count > 0;
  return {trajectory.name,
          FormatNumber(error.rotation_deg.rmse, 3),
          FormatNumber(error.rotation_deg.median, 3),
          FormatNumber(error.rotation_deg.max, 3),
          has_segments ? FormatPercent(error.relative_position.mean, 3) : "-",
          has_segments ? FormatNumber(error.relative_rotation_deg.mean, 3) : "-",
          FormatNumber(error.S_truth_estimate.scale())};
}

std::string AlignmentNote(const TrajectoryErrorOptions& options) {
  if (options.align == "none") return "Poses are compared as they are, without alignment.";
  return std::string("Aligned to the truth by least squares over the positions (Umeyama), ") +
         (options.align == "sim3" ? "with scale (Sim3)." : "without scale (SE3).");
}

}  // namespace

TrajectoryEvaluation EvaluateTrajectory(const std::string& name,
                                        const std::filesystem::path& estimate,
                                        std::span<const StampedPose> truth,
                                        const TrajectoryTimes& times,
                                        const TrajectoryErrorOptions& options) {
  const std::vector<StampedPose> poses = ReadAnyTrajectory(estimate, times);
  try {
    return {name, CompareTrajectories(poses, truth, options)};
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    throw Error(
        ErrorParts{.what = error.what(), .where = estimate.string(), .expected = {}, .found = {}});
  }
}

Json ToJson(const TrajectoryError& error, std::optional<double> mean_depth_m) {
  Json json = {{"estimated_poses", error.num_estimated}, {"true_poses", error.num_true},
               {"associated_poses", error.poses.size()}, {"truth_coverage", error.truth_coverage},
               {"path_length_m", error.path_length},     {"position_m", ToJson(error.position)}};
  if (mean_depth_m) json["position_rmse_of_mean_depth"] = error.position.rmse / *mean_depth_m;
  json["rotation_deg"] = ToJson(error.rotation_deg);
  json["relative_position"] = ToJson(error.relative_position);
  json["relative_rotation_deg_per_m"] = ToJson(error.relative_rotation_deg);
  json["alignment"] = ToJson(error.S_truth_estimate);
  json["is_straight"] = error.is_straight;
  return json;
}

Section TrajectorySection(std::span<const TrajectoryEvaluation> trajectories,
                          const TrajectoryErrorOptions& options,
                          std::optional<double> mean_depth_m) {
  Table positions;
  positions.title = mean_depth_m ? "Trajectory: distance from the truth in metres (and in percent "
                                   "of the mean depth)"
                                 : "Trajectory: distance from the truth in metres";
  positions.columns = {"trajectory", "poses", "compared", "truth covered", "RMSE", "MAE",
                       "median",     "sigma", "max"};
  Table rotations;
  rotations.title = "Trajectory: rotation, and error over segments of the way";
  rotations.columns = {"trajectory",     "rotation RMSE deg", "median deg",    "max deg",
                       "relative error", "rotation deg/m",    "scale to truth"};
  bool is_straight = false;
  for (const TrajectoryEvaluation& trajectory : trajectories) {
    positions.rows.push_back(PositionRow(trajectory, mean_depth_m));
    rotations.rows.push_back(RotationRow(trajectory));
    is_straight |= trajectory.error.is_straight;
  }
  positions.notes.push_back(AlignmentNote(options));
  if (is_straight) {
    positions.notes.emplace_back(
        "The true way is a straight line: the rotation about it is taken from the orientations.");
  }
  rotations.notes.push_back("Segments of " + FormatPercent(options.relative_segment, 0) +
                            " of the way: error of the motion by the length of the segment.");
  Section section;
  section.title = "Trajectory";
  section.tables = {positions, rotations};
  return section;
}

Figure TrajectoryFigure(const TrajectoryEvaluation& trajectory,
                        std::span<const StampedPose> truth) {
  Figure figure;
  figure.name = "trajectory_" + trajectory.name;
  for (char& c : figure.name) c = c == ' ' ? '_' : c;
  TrajectoryPictureOptions options;
  options.title = trajectory.name;
  figure.image = TrajectoryPicture(trajectory.error, truth, options);
  figure.caption = "The " + trajectory.name +
                   " trajectory from above, coloured by its distance from the truth (dashed).";
  figure.alternative =
      "Plot of the camera's way from above: " + std::to_string(trajectory.error.poses.size()) +
      " estimated positions over the true way, RMSE " +
      FormatNumber(trajectory.error.position.rmse, 3) + " m, largest error " +
      FormatNumber(trajectory.error.position.max, 3) + " m.";
  return figure;
}

Evaluation EvaluateTrajectoryFiles(const TrajectoryArguments& arguments, bool with_pictures) {
  arguments.options.Validate();
  RequireOption(arguments.mean_depth_m >= 0, "mean-depth", "a length in metres, 0: not known",
                arguments.mean_depth_m);
  RequireOption(arguments.fps > 0, "fps", "more than 0", arguments.fps);
  TrajectoryTimes times;
  times.fps = arguments.fps;
  if (!arguments.times.empty()) times.timestamps_s = ReadTimestamps(arguments.times);
  const std::vector<StampedPose> truth = ReadAnyTrajectory(arguments.truth, times);
  const TrajectoryEvaluation trajectory =
      EvaluateTrajectory("estimate", arguments.estimate, truth, times, arguments.options);
  const std::optional<double> mean_depth_m =
      arguments.mean_depth_m > 0 ? std::optional(arguments.mean_depth_m) : std::nullopt;

  Evaluation evaluation;
  evaluation.page.title = "Trajectory";
  evaluation.page.subtitle = arguments.estimate + " against " + arguments.truth;
  evaluation.page.sections = {TrajectorySection({&trajectory, 1}, arguments.options, mean_depth_m)};
  if (with_pictures) {
    evaluation.page.sections[0].figures.push_back(TrajectoryFigure(trajectory, truth));
  }
  evaluation.json = RecordOf("trajectory", arguments.estimate, arguments.truth);
  evaluation.json["align"] = arguments.options.align;
  evaluation.json["trajectory"] = ToJson(trajectory.error, mean_depth_m);
  return evaluation;
}

}  // namespace mono3d::tools
