// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "bench/device_times.h"
#include "mono3d/fusion/surfel_map.h"
#include "report/table.h"

namespace mono3d::tools {

// What it costs to register and fuse a depth map with a large model, to correct that model after a
// loop, and to make it coarser when it is full. The scene is made up (bench/fusion_bench_scene.h).
struct FusionBenchOptions {
  int width_px = 768;
  int height_px = 448;
  int num_surfels = 1'000'000;  // of the model, on average over the timed maps
  int num_repeats = 6;          // timed maps of each kind
  double error_px = 3;          // of the wrong poses
  SurfelMapOptions fusion;
};

struct FusionBenchResult {
  std::string device;
  int width = 0, height = 0;
  std::int64_t num_surfels = 0;    // on average over the timed maps
  std::int64_t num_new = 0;        // and per map
  int num_rejected = 0;            // timed maps that the model refused
  Spread right_cpu_ms;             // process CPU of a map whose pose the model confirms
  Spread wrong_cpu_ms;             // of one whose pose it has to find
  Spread found_error_px;           // from the true pose, as motion in the image, where it did
  Spread num_evaluations;          // of the registration there
  std::vector<StageSpread> right;  // device time of the stages of these
  std::vector<StageSpread> wrong;
  // The first depth map of the process, with all that is made once.
  double first_cpu_ms = 0;
  double first_wall_ms = 0;
  // The model before it is corrected, as a point cloud.
  std::int64_t num_exported = 0;
  double export_cpu_ms = 0;
  // A whole loop is closed: 5 degrees and 3 % of scale between its ends.
  std::int64_t num_corrected = 0;  // surfels before
  double correction_cpu_ms = 0;
  double correction_wall_ms = 0;
  // What it leaves to be merged, all at once, as an export does it.
  std::int64_t num_merged = 0;
  double merging_cpu_ms = 0;
  std::vector<StageSpread> merging;
  // A map for which the model, full, becomes coarser.
  std::int64_t num_full = 0;    // surfels before
  std::int64_t num_coarse = 0;  // and after, with the map
  double coarsening_cpu_ms = 0;
  double coarsening_wall_ms = 0;
};

// Throws Error when the model refuses a map while it is made.
FusionBenchResult BenchFusion(const FusionBenchOptions& options, const DeviceOptions& device);

std::vector<Table> ToTables(const FusionBenchResult& result);
Json ToJson(const FusionBenchResult& result);

}  // namespace mono3d::tools
