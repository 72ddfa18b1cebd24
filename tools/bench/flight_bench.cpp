// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/flight_bench.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "bench/fusion_bench_scene.h"
#include "mono3d/core/error.h"
#include "mono3d/core/state_folder.h"

namespace mono3d::tools {
namespace {

constexpr double kWholeTurnDeg = 5;
constexpr double kWholeScale = 1.03;

// "VmRSS" or "VmHWM" of this process, in MB.
double StatusMb(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return std::stod(line.substr(name.size() + 1)) / 1024;
  }
  return 0;
}

struct Flight {
  const FlightBenchOptions& options;
  std::unique_ptr<SurfelMap> model;
  std::vector<KeyframePose> poses;
  std::optional<StateFolder> state;

  // A keyframe of its own, over the place of this number.
  FusionResult Fly(int place) {
    PosedDepthMap posed =
        WavyGroundMap(options.width_px, options.height_px, place, options.new_share);
    const auto number = static_cast<std::int64_t>(poses.size());
    posed.map.keyframe_id = posed.map.frame_index = number;
    poses.push_back({number, 0, Similarity(1, posed.T_world_cam)});
    const KeyframePoses now(poses.size(), poses);
    const double cpu_ms = ProcessCpuMs();
    const double wall_ms = WallClockMs();
    FusionResult result = model->Integrate(posed.map, now);
    last_cpu_ms = ProcessCpuMs() - cpu_ms;
    last_wall_ms = WallClockMs() - wall_ms;
    if (result.status != FusionStatus::kFused) throw Error("map not fused: " + result.reason);
    return result;
  }

  double last_cpu_ms = 0;
  double last_wall_ms = 0;
};

// Over `places`, a row.
template <typename Places>
FlightBenchResult::Row FlyRow(const std::string& part, const Places& places, Flight& flight) {
  FlightBenchResult::Row row;
  row.part = part;
  std::vector<double> cpu_ms;
  for (const int place : places) {
    const FusionResult result = flight.Fly(place);
    cpu_ms.push_back(flight.last_cpu_ms);
    row.wall_ms += flight.last_wall_ms;
    row.num_new += result.num_inserted;
    row.num_surfels = result.num_surfels;
    if (flight.model->num_surfels() >= flight.options.num_surfels && part == "out") break;
  }
  const auto num_maps = static_cast<double>(cpu_ms.size());
  row.wall_ms /= num_maps;
  row.num_new = std::llround(static_cast<double>(row.num_new) / num_maps);
  row.cpu_ms = SpreadOf(std::move(cpu_ms));
  if (flight.state) {
    const double start_ms = ProcessCpuMs();
    flight.model->SaveState(*flight.state, "model");
    row.saved_mb = static_cast<double>(flight.state->Commit().bytes_new) / 1e6;
    row.save_cpu_ms = ProcessCpuMs() - start_ms;
  }
  row.resident_mb = StatusMb("VmRSS");
  return row;
}

// A whole loop is closed: a turn and a scale between its ends.
double CorrectFlight(Flight& flight) {
  const Eigen::Vector3d turn =
      kWholeTurnDeg * std::numbers::pi / 180 * Eigen::Vector3d(1, -2, 2) / 3;
  const double last = static_cast<double>(flight.poses.size() - 1);
  for (std::size_t i = 0; i < flight.poses.size(); ++i) {
    const double share = static_cast<double>(i) / last;
    const Similarity motion(std::pow(kWholeScale, share),
                            Pose(RotationExp(share * turn), Eigen::Vector3d::Zero()));
    flight.poses[i].S_world_kf = motion * flight.poses[i].S_world_kf;
  }
  const KeyframePoses poses(flight.poses.size() + 1, flight.poses);
  const double cpu_ms = ProcessCpuMs();
  (void)flight.model->Update(poses);
  return ProcessCpuMs() - cpu_ms;
}

void ExportFlight(const Flight& flight, FlightBenchResult& result) {
  const SurfelExportOptions options;
  const std::int64_t before = flight.model->num_surfels();
  const double start_ms = ProcessCpuMs();
  (void)flight.model->Export(1'000'000);  // nothing is seen so often: what is merged alone
  result.merging_cpu_ms = ProcessCpuMs() - start_ms;
  result.num_merged = before - flight.model->num_surfels();
  const double cpu_ms = ProcessCpuMs();
  const double wall_ms = WallClockMs();
  const PointCloud cloud = flight.model->Export(options);
  result.export_cpu_ms = ProcessCpuMs() - cpu_ms;
  result.export_wall_ms = WallClockMs() - wall_ms;
  result.num_exported = static_cast<std::int64_t>(cloud.size());
  result.resident_mb_with_export = StatusMb("VmRSS");
  result.most_resident_mb = StatusMb("VmHWM");
}

}  // namespace

FlightBenchResult BenchFlight(const FlightBenchOptions& options, const DeviceOptions& device) {
  options.fusion.Validate();
  const std::shared_ptr<Device> opened = OpenDevice(device);
  FlightBenchResult result;
  result.device = Info(*opened).name;
  Flight flight{options, CreateSurfelMap(opened, options.fusion), {}, std::nullopt};
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("mono3d_flight_" + std::to_string(getpid()));
  if (options.with_save) flight.state.emplace(folder);
  std::vector<int> places;
  while (flight.model->num_surfels() < options.num_surfels) {
    const auto first = static_cast<int>(flight.poses.size());
    places.clear();
    for (int i = 0; i < options.num_per_row; ++i) places.push_back(first + i);
    result.rows.push_back(FlyRow("out", places, flight));
    if (result.rows.back().num_new == 0) throw Error("the model does not grow");
  }
  places.clear();
  for (int i = 0; i < options.num_maps_again; ++i) places.push_back(i);
  result.rows.push_back(FlyRow("the beginning again", places, flight));
  result.correction_cpu_ms = CorrectFlight(flight);
  ExportFlight(flight, result);
  std::error_code ignored;
  if (options.with_save) std::filesystem::remove_all(folder, ignored);
  return result;
}

std::vector<Table> ToTables(const FlightBenchResult& result) {
  Table table;
  table.title = "Depth maps of one long flight on " + result.device;
  table.columns = {"",        "million surfels", "new a map",   "CPU ms a map, least",
                   "median",  "ms passed",       "resident MB", "save, CPU ms",
                   "saved MB"};
  for (const FlightBenchResult::Row& row : result.rows) {
    table.rows.push_back({row.part, FormatFixed(1e-6 * static_cast<double>(row.num_surfels), 2),
                          std::to_string(row.num_new), FormatFixed(row.cpu_ms.least, 0),
                          FormatFixed(row.cpu_ms.median, 0), FormatFixed(row.wall_ms, 0),
                          FormatFixed(row.resident_mb, 0), FormatFixed(row.save_cpu_ms, 0),
                          FormatFixed(row.saved_mb, 1)});
  }
  table.notes = {"A correction of all of it took " + FormatFixed(result.correction_cpu_ms, 1) +
                     " ms of processor time, merging what came to lie upon each other " +
                     FormatFixed(result.merging_cpu_ms, 0) + " ms (" +
                     std::to_string(result.num_merged) + " surfels).",
                 "Exporting " + std::to_string(result.num_exported) + " surfels took " +
                     FormatFixed(1e-3 * result.export_cpu_ms, 1) + " s of processor time, " +
                     FormatFixed(1e-3 * result.export_wall_ms, 1) + " s passed; resident then " +
                     FormatFixed(result.resident_mb_with_export, 0) + " MB, at most " +
                     FormatFixed(result.most_resident_mb, 0) + " MB at any time."};
  return {table};
}

}  // namespace mono3d::tools
