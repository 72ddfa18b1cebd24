// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evaluate/cloud_part.h"
#include "evaluate/files.h"
#include "evaluate/run_arguments.h"
#include "evaluate/trajectory_part.h"

namespace mono3d::tools {

// A run beside its sequence: the files of both, and what their comparison found.
struct Comparison {
  const RunArguments& arguments;
  RunFiles run = {};
  SequenceFiles sequence = {};
  std::vector<StampedPose> truth = {};
  std::optional<MeanDepth> mean_depth = {};
  std::optional<double> mean_depth_m = {};
  std::vector<TrajectoryEvaluation> trajectories = {};
  std::vector<ModelEvaluation> models = {};
  std::optional<DepthEvaluation> depth = {};
  Json record = {};
  std::vector<std::string> left_out = {};
};

Json MakeJson(const Comparison& comparison);
Page MakePage(const Comparison& comparison, bool with_pictures);

}  // namespace mono3d::tools
