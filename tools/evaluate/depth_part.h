// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluate/evaluation.h"
#include "evaluate/files.h"
#include "mono3d/evaluation/confidence_calibration.h"
#include "mono3d/evaluation/depth_error.h"
#include "mono3d/evaluation/normal_error.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::tools {

struct DepthEvaluationOptions {
  // "map": median scaling of each map, as in the paper; "run": one scale for all, the median of
  // the maps' scales; "none": the estimate is metric.
  std::string scaling = "map";
  double max_depth_m = 0;  // true depths beyond are left out (the paper: 300 m); 0: none
  double png_scale = 0;    // metres = value / png_scale; 0: from scale.txt beside the images

  void Validate() const;  // throws UsageError
};

// One estimate and the files that go with it; empty where there is none.
struct DepthFiles {
  std::int64_t frame = 0;
  std::filesystem::path estimate;
  std::filesystem::path truth;
  std::filesystem::path confidence;
  std::filesystem::path normal;
};

struct DepthMapEvaluation {
  DepthFiles files;
  DepthError error;
  std::optional<DepthError> matched;   // of what was not inferred, where the files tell
  std::optional<double> median_scale;  // that would fit this map best
  std::optional<ConfidenceCalibration> confidence;
  std::optional<NormalError> normals;
};

struct DepthEvaluation {
  DepthEvaluationOptions options;
  std::vector<DepthMapEvaluation> maps;  // in order of frames
  MeanDepthError mean;
  std::optional<MeanDepthError> matched;            // where something was inferred
  std::optional<ConfidenceCalibration> confidence;  // means over the maps that have one
  std::optional<NormalError> normals;
  // Standard deviation of the maps' own scales as a share of their median: does the estimate keep
  // its scale?
  double scale_spread = 0;
};

// Compares each estimate with its truth. Confidence and normals are read where the files name them;
// normals need the camera of the images. Throws Error when there is no pair, a file cannot be read,
// or an estimate and its truth differ in size.
DepthEvaluation EvaluateDepthMaps(const std::vector<DepthFiles>& files,
                                  const DepthEvaluationOptions& options,
                                  const std::optional<CameraModel>& camera);

// Mean over the maps of each map's mean true depth. At most 100 maps are read, evenly spread.
struct MeanDepth {
  double metres = 0;
  int num_maps = 0;  // that were read and have a depth
};
// Nothing when no map has a depth.
std::optional<MeanDepth> FindMeanDepth(const FilesByFrame& truth,
                                       const DepthEvaluationOptions& options);

Json ToJson(const DepthEvaluation& evaluation);
// Tables for depth, confidence and normals; with pictures, those of the best, the middle and the
// worst map.
std::vector<Section> DepthSections(const DepthEvaluation& evaluation, bool with_pictures);

// Everything of `mono3d-evaluate depth`.
struct DepthArguments {
  std::string estimate;  // a file, or a folder whose files are matched by the number in their names
  std::string truth;
  std::string camera;  // for normals; empty: none
  DepthEvaluationOptions options;
};
Evaluation EvaluateDepthFiles(const DepthArguments& arguments, bool with_pictures);

}  // namespace mono3d::tools
