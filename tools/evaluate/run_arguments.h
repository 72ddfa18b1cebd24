// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "evaluate/depth_part.h"
#include "mono3d/evaluation/trajectory_error.h"

namespace mono3d::tools {

// Everything of `mono3d-evaluate run`.
struct RunArguments {
  std::string run;          // folder that mono3d-reconstruct wrote
  std::string sequence;     // folder with the truth
  double mean_depth_m = 0;  // 0: from the true depth maps
  TrajectoryErrorOptions trajectory;
  DepthEvaluationOptions depth;
};

}  // namespace mono3d::tools
