// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "bench/sequence_result.h"
#include "mono3d/gpu/device.h"
#include "mono3d/pipeline/pipeline.h"
#include "report/table.h"

namespace mono3d::tools {

// What registration and confidence buy: sequences with truth are tracked once, their depth maps
// fused with the default options and with one part after the other exchanged, at the tracker's
// poses and at worse ones.
struct FusionAblationOptions {
  std::vector<std::string> folders;  // images/, camera.yaml, groundtruth.txt, depth/, cloud.ply
  double pose_error = 0.005;         // of the worse poses: root mean square, share of the depth
  std::vector<std::string> only;     // names of variants beside the first; none: all
  PipelineOptions pipeline;          // of the first variant
};

struct FusionVariant {
  std::string name;
  SurfelMapOptions fusion;
  bool has_pose_errors = false;
};

// The first is `fusion` itself at the tracker's poses.
std::vector<FusionVariant> FusionVariants(const SurfelMapOptions& fusion);

// Lengths are shares of the mean depth; the model's against all that the frames show
// (evaluate/surface_part.h), the shares within 1 % of the depth.
struct FusionFigures {
  double num_maps = 0;
  double num_fused = 0;
  double num_moved = 0;        // away from the tracker's pose
  double trajectory_rmse = 0;  // of the fused maps
  double model_rmse = 0;
  double accuracy = 0;
  double completeness = 0;  // of what five frames see
  double f_score = 0;
  double cpu_ms = 0;  // of the process, per depth map
};

struct FusionAblationRow {
  std::string name;
  std::vector<FusionFigures> sequences;  // in the order of the folders
};

struct FusionAblationResult {
  std::string device;
  double pose_error = 0;
  std::vector<std::string> sequences;  // names of the folders
  std::vector<FusionAblationRow> rows;
};

// The mean of each figure but the counts, which are sums.
FusionFigures MeanFigures(const std::vector<FusionFigures>& figures);

// Throws Error when a sequence lacks a truth or yields no depth map, UsageError on a variant that
// there is not.
FusionAblationResult RunFusionAblation(const FusionAblationOptions& options,
                                       const DeviceOptions& device);

// The means over the sequences; then the trajectory and the model by sequence.
std::vector<Table> ToTables(const FusionAblationResult& result);
Json ToJson(const FusionAblationResult& result);

}  // namespace mono3d::tools
