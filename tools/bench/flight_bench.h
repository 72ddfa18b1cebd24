// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/device_times.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/gpu/device.h"
#include "report/table.h"

namespace mono3d::tools {

// What a model costs that grows without end: the straight flight of bench/fusion_bench_scene.h,
// true poses, until the model has so many surfels; then back to its beginning, a correction of all
// of it, and an export.
struct FlightBenchOptions {
  int width_px = 768;
  int height_px = 448;
  int num_surfels = 20'000'000;
  double new_share = 0.3;   // of the ground in a map that those before do not show
  int num_per_row = 20;     // depth maps of one row of the table
  int num_maps_again = 20;  // of the way back
  bool with_save = false;   // and save the state after each row, to a folder that is removed
  SurfelMapOptions fusion;
};

struct FlightBenchResult {
  struct Row {
    std::string part;              // of the flight
    std::int64_t num_surfels = 0;  // afterwards
    std::int64_t num_new = 0;      // per map
    Spread cpu_ms;                 // of a map
    double wall_ms = 0;            // of a map, mean
    double resident_mb = 0;        // of the process, afterwards
    double save_cpu_ms = 0;
    double saved_mb = 0;  // written
  };
  std::string device;
  std::vector<Row> rows;
  double correction_cpu_ms = 0;
  double merging_cpu_ms = 0;  // of what it leaves to be merged, all at once
  std::int64_t num_merged = 0;
  std::int64_t num_exported = 0;
  double export_cpu_ms = 0;
  double export_wall_ms = 0;
  double resident_mb_with_export = 0;  // while the exported cloud is held
  double most_resident_mb = 0;         // at any time
};

// Throws Error when the model refuses a map.
FlightBenchResult BenchFlight(const FlightBenchOptions& options, const DeviceOptions& device);

std::vector<Table> ToTables(const FlightBenchResult& result);

}  // namespace mono3d::tools
