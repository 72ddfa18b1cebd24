// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "evaluate/evaluation.h"
#include "evaluate/mesh_part.h"
#include "evaluate/surface_part.h"
#include "mono3d/evaluation/cloud_evaluation.h"
#include "mono3d/evaluation/trajectory_error.h"

namespace mono3d::tools {

// A model against the true surface.
struct ModelEvaluation {
  std::string name;
  CloudEvaluation cloud;
  PointCloud truth;
  std::optional<double> mean_depth_m;
  std::optional<SurfaceEvaluation> surface;  // where more is known than the true cloud
  std::optional<MeshEvaluation> mesh;        // where the run made one
  bool start_is_known = true;  // from the trajectories; else the clouds were taken as they lie
};

// Reads both and compares them in the paper's three steps. The shares within 0.5, 1 and 2 % of the
// mean depth need the mean depth. Throws Error; what() names the file.
ModelEvaluation EvaluateModel(const std::string& name, const std::filesystem::path& estimate,
                              const std::filesystem::path& truth,
                              const std::optional<Similarity>& S_truth_estimate,
                              std::optional<double> mean_depth_m);

// model_errors.ply beside the model: how far each of its points is from the truth. Throws Error
// when it cannot be written.
void WriteErrorsBeside(const std::filesystem::path& model_path, const ModelEvaluation& model);

Json ToJson(const ModelEvaluation& model);
// With pictures: the model from three sides beside the truth, in two colours, and by distance.
Section ModelSection(const ModelEvaluation& model, bool with_pictures);

// Everything of `mono3d-evaluate cloud`.
struct CloudArguments {
  std::string estimate;
  std::string truth;
  std::string estimate_trajectory;  // both or neither
  std::string truth_trajectory;
  double mean_depth_m = 0;  // 0: not known
  TrajectoryErrorOptions trajectory;
};
Evaluation EvaluateCloudFiles(const CloudArguments& arguments, bool with_pictures);

}  // namespace mono3d::tools
