// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "evaluate/evaluation.h"
#include "mono3d/evaluation/trajectory_error.h"
#include "mono3d/io/any_trajectory_file.h"

namespace mono3d::tools {

// One trajectory against the truth.
struct TrajectoryEvaluation {
  std::string name;  // "final", "online", "model"
  TrajectoryError error;
};

// Reads the estimate and compares it. Throws Error; what() begins with the file.
TrajectoryEvaluation EvaluateTrajectory(const std::string& name,
                                        const std::filesystem::path& estimate,
                                        std::span<const StampedPose> truth,
                                        const TrajectoryTimes& times,
                                        const TrajectoryErrorOptions& options);

Json ToJson(const TrajectoryError& error, std::optional<double> mean_depth_m);

// The tables, and, with pictures, the way over the true way for each that `has_picture` names.
Section TrajectorySection(std::span<const TrajectoryEvaluation> trajectories,
                          const TrajectoryErrorOptions& options,
                          std::optional<double> mean_depth_m);
Figure TrajectoryFigure(const TrajectoryEvaluation& trajectory, std::span<const StampedPose> truth);

// Everything of `mono3d-evaluate trajectory`.
struct TrajectoryArguments {
  std::string estimate;
  std::string truth;
  std::string times;        // file, one time a line, for KITTI and COLMAP files
  double fps = 30;          // without it
  double mean_depth_m = 0;  // 0: not known
  TrajectoryErrorOptions options;
};
Evaluation EvaluateTrajectoryFiles(const TrajectoryArguments& arguments, bool with_pictures);

}  // namespace mono3d::tools
