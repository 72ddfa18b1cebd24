// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/sequence_result.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/tracking/tracker.h"
#include "report/table.h"

namespace mono3d::tools {

// What tracking alone makes of a sequence, and what it costs.
struct TrackingBenchOptions {
  std::string folder;       // of a sequence: images/, camera.yaml; truth where there is some
  double mean_depth_m = 0;  // that errors are a share of; 0: from the true depth maps
  FrameSourceOptions source;
  TrackerOptions tracking;
};

struct TrackingBenchStage {
  std::string name;
  std::int64_t num_calls = 0;
  double cpu_ms_per_frame = 0;
};

struct TrackingBenchResult {
  std::string name;
  int width = 0, height = 0;
  std::int64_t num_frames = 0;
  std::int64_t num_tracked = 0;             // when they came
  std::int64_t num_with_pose = 0;           // in the end
  std::int64_t num_keyframes = 0;           // still there in the end or culled
  std::size_t num_maps = 0;                 // with a trajectory
  std::optional<std::int64_t> first_frame;  // the first one tracked when it came
  // Root mean square distance from the truth, of the largest map, aligned by a similarity.
  std::optional<double> final_rmse_m, online_rmse_m;
  std::optional<double> final_rotation_deg;
  std::optional<double> mean_depth_m;
  double cpu_ms_per_frame = 0;     // of the process, without reading the images
  double thread_ms_per_frame = 0;  // of the thread that Track is called on
  double max_thread_ms = 0;        // of one call
  std::vector<TrackingBenchStage> stages;
};

// Throws Error when the folder holds no images or no calibration.
TrackingBenchResult BenchTracking(const TrackingBenchOptions& options);

Table ToTable(const TrackingBenchResult& result);
Json ToJson(const TrackingBenchResult& result);

}  // namespace mono3d::tools
