// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/fusion_bench.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <utility>

#include "bench/fusion_bench_scene.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d::tools {
namespace {

constexpr double kLoopTurnDeg = 5;
constexpr double kLoopScale = 1.03;

// A model that grows map by map.
struct Model {
  Model(std::shared_ptr<Device> device, const SurfelMapOptions& options)
      : surfels(CreateSurfelMap(std::move(device), options, &times)) {}

  StageTimes times;
  std::unique_ptr<SurfelMap> surfels;
  std::vector<KeyframePose> poses;  // of its maps
};

PosedDepthMap NextMap(const FusionBenchOptions& options, const Model& model) {
  return WavyGroundMap(options.width_px, options.height_px, static_cast<int>(model.poses.size()));
}

FusionResult Add(const PosedDepthMap& posed, Model& model) {
  model.poses.push_back({posed.map.keyframe_id, 0, Similarity(1, posed.T_world_cam)});
  return model.surfels->Integrate(posed.map, KeyframePoses(model.poses.size(), model.poses));
}

// Fuses maps until the model has so many surfels, less half of what is timed. Returns how many a
// map brings.
std::int64_t Build(const FusionBenchOptions& options, int num_timed, Model& model) {
  std::int64_t num_new = 0;  // of a map after the first
  while (model.surfels->num_surfels() + num_new * num_timed / 2 < options.num_surfels) {
    const FusionResult result = Add(NextMap(options, model), model);
    if (result.status != FusionStatus::kFused) throw Error("map not fused: " + result.reason);
    if (result.num_inserted == 0) throw Error("the model does not grow to the surfels asked for");
    if (model.poses.size() > 1) num_new = result.num_inserted;
  }
  return num_new;
}

// Mean over the image of how far apart two poses see what one of them sees.
double ImageDistance_px(const DepthMap& map, const Pose& a, const Pose& b) {
  const CameraModel& camera = map.camera;
  const double depth_su = cv::mean(map.depth, map.depth > 0)[0];
  double sum_px = 0;
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector2d pixel(0.5 * (i % 3) * camera.width, 0.5 * (i / 3) * camera.height);
    const Eigen::Vector3d p = b.Inverse() * (a * (depth_su * camera.Unproject(pixel)));
    sum_px += (camera.Project(p) - pixel).norm() / 9;
  }
  return sum_px;
}

// Right and wrong poses in turn.
void TimeMaps(const FusionBenchOptions& options, Model& model, FusionBenchResult& result) {
  std::vector<double> right_cpu_ms, wrong_cpu_ms, found_error_px, num_evaluations;
  StageDifferences right, wrong;
  double sum_surfels = 0;
  for (int i = 0; i < 2 * options.num_repeats; ++i) {
    const bool is_wrong = i % 2 == 1;
    PosedDepthMap map = NextMap(options, model);
    const Pose truth = map.T_world_cam;
    if (is_wrong) map = Misplaced(map, options.error_px, i);
    sum_surfels += static_cast<double>(model.surfels->num_surfels());
    StageDifferences& stages = is_wrong ? wrong : right;
    stages.Skip(model.times.Snapshot());
    const double start_ms = ProcessCpuMs();
    const FusionResult fused = Add(map, model);
    (is_wrong ? wrong_cpu_ms : right_cpu_ms).push_back(ProcessCpuMs() - start_ms);
    stages.Add(model.times.Snapshot());
    if (fused.status != FusionStatus::kFused) ++result.num_rejected;
    if (!is_wrong) continue;
    found_error_px.push_back(ImageDistance_px(map.map, truth, fused.S_world_kf.pose()));
    num_evaluations.push_back(fused.registration.num_iterations);
  }
  result.num_surfels = std::llround(sum_surfels / (2 * options.num_repeats));
  result.right_cpu_ms = SpreadOf(right_cpu_ms);
  result.wrong_cpu_ms = SpreadOf(wrong_cpu_ms);
  result.found_error_px = SpreadOf(found_error_px);
  result.num_evaluations = SpreadOf(num_evaluations);
  result.right = right.Stages();
  result.wrong = wrong.Stages();
}

void TimeFirstMap(const FusionBenchOptions& options, Model& model, FusionBenchResult& result) {
  const PosedDepthMap map = NextMap(options, model);
  const double cpu_ms = ProcessCpuMs();
  const double wall_ms = WallClockMs();
  Add(map, model);
  result.first_cpu_ms = ProcessCpuMs() - cpu_ms;
  result.first_wall_ms = WallClockMs() - wall_ms;
}

void TimeExport(const Model& model, FusionBenchResult& result) {
  const double cpu_ms = ProcessCpuMs();
  result.num_exported = static_cast<std::int64_t>(model.surfels->Export(1).size());
  result.export_cpu_ms = ProcessCpuMs() - cpu_ms;
}

void TimeCorrection(Model& model, FusionBenchResult& result) {
  std::vector<KeyframePose> moved = model.poses;
  const Eigen::Vector3d turn =
      kLoopTurnDeg * std::numbers::pi / 180 * Eigen::Vector3d(1, -2, 2) / 3;
  for (std::size_t i = 0; i < model.poses.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(model.poses.size() - 1);
    const Similarity motion(std::pow(kLoopScale, share),
                            Pose(RotationExp(share * turn), Eigen::Vector3d::Zero()));
    moved[i].S_world_kf = motion * model.poses[i].S_world_kf;
  }
  result.num_corrected = model.surfels->num_surfels();
  const KeyframePoses poses(model.poses.size() + 1, std::move(moved));
  const double cpu_ms = ProcessCpuMs();
  const double wall_ms = WallClockMs();
  (void)model.surfels->Update(poses);
  result.correction_cpu_ms = ProcessCpuMs() - cpu_ms;
  result.correction_wall_ms = WallClockMs() - wall_ms;
}

// An export that has to merge first, less one that has not.
void TimeMerging(Model& model, FusionBenchResult& result) {
  StageDifferences stages;
  stages.Skip(model.times.Snapshot());
  const auto export_cpu_ms = [&] {
    const double cpu_ms = ProcessCpuMs();
    (void)model.surfels->Export(1);
    return ProcessCpuMs() - cpu_ms;
  };
  const double with_merging_ms = export_cpu_ms();
  stages.Add(model.times.Snapshot());
  result.merging_cpu_ms = std::max(0.0, with_merging_ms - export_cpu_ms());
  result.num_merged = result.num_corrected - model.surfels->num_surfels();
  result.merging = stages.Stages();
}

// A model that may have no more surfels than those of the timed maps.
void TimeCoarsening(const FusionBenchOptions& options, const std::shared_ptr<Device>& device,
                    FusionBenchResult& result) {
  SurfelMapOptions full = options.fusion;
  full.max_surfels = options.num_surfels;
  Model model(device, full);
  for (;;) {
    const PosedDepthMap map = NextMap(options, model);
    const std::int64_t before = model.surfels->num_surfels();
    const double cpu_ms = ProcessCpuMs();
    const double wall_ms = WallClockMs();
    const FusionResult fused = Add(map, model);
    if (fused.status != FusionStatus::kFused) throw Error("map not fused: " + fused.reason);
    if (fused.num_surfels >= before) continue;
    result.coarsening_cpu_ms = ProcessCpuMs() - cpu_ms;
    result.coarsening_wall_ms = WallClockMs() - wall_ms;
    result.num_full = before;
    result.num_coarse = fused.num_surfels;
    return;
  }
}

Table StageTable(const std::string& title, const std::vector<StageSpread>& stages) {
  Table table;
  table.title = title;
  table.columns = {"", "least ms", "median ms"};
  for (const StageSpread& stage : stages) {
    table.rows.push_back({stage.name, FormatFixed(stage.device_ms.least, 1),
                          FormatFixed(stage.device_ms.median, 1)});
  }
  return table;
}

void AddCpu(Table& table, const Spread& cpu_ms) {
  table.rows.push_back(
      {"process CPU", FormatFixed(cpu_ms.least, 1), FormatFixed(cpu_ms.median, 1)});
}

Json ToJson(const std::vector<StageSpread>& stages) {
  Json json = Json::object();
  for (const StageSpread& stage : stages) json[stage.name] = ToJson(stage.device_ms);
  return json;
}

}  // namespace

FusionBenchResult BenchFusion(const FusionBenchOptions& options,
                              const DeviceOptions& device_options) {
  options.fusion.Validate();
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  FusionBenchResult result;
  result.device = Info(*device).name;
  result.width = options.width_px;
  result.height = options.height_px;
  {
    Model model(device, options.fusion);
    TimeFirstMap(options, model, result);
    result.num_new = Build(options, 2 * options.num_repeats, model);
    TimeMaps(options, model, result);
    TimeExport(model, result);
    TimeCorrection(model, result);
    TimeMerging(model, result);
  }
  TimeCoarsening(options, device, result);
  return result;
}

std::vector<Table> ToTables(const FusionBenchResult& result) {
  const auto count = [](std::int64_t number) { return std::to_string(number); };
  Table right = StageTable("A depth map of " + std::to_string(result.width) + " x " +
                               std::to_string(result.height) + " into " +
                               count(result.num_surfels) + " surfels on " + result.device,
                           result.right);
  AddCpu(right, result.right_cpu_ms);
  Table wrong = StageTable("One whose pose is wrong", result.wrong);
  AddCpu(wrong, result.wrong_cpu_ms);
  wrong.notes = {count(result.num_new) + " surfels are new with each map; " +
                 std::to_string(result.num_rejected) +
                 " maps were refused. The pose was found to " +
                 FormatFixed(result.found_error_px.median, 3) + " px in " +
                 FormatFixed(result.num_evaluations.median, 0) +
                 " evaluations (median). Stages are timed by " +
                 "the device's clock: on a CPU device busy with other programs they look slower " +
                 "than they are."};
  Table correction = StageTable("Merging after the correction of a whole loop, " +
                                    count(result.num_corrected) + " surfels, all at once",
                                result.merging);
  AddCpu(correction, {result.merging_cpu_ms, result.merging_cpu_ms});
  correction.notes = {"The correction itself: " + FormatFixed(result.correction_cpu_ms, 2) +
                      " ms of processor time, " + FormatFixed(result.correction_wall_ms, 2) +
                      " ms passed. " + count(result.num_merged) +
                      " surfels were merged with others."};
  Table coarsening;
  coarsening.title = "A full model becomes coarser";
  coarsening.columns = {"", "surfels before", "after", "process CPU ms", "ms passed"};
  coarsening.rows = {{"the map for which it does", count(result.num_full), count(result.num_coarse),
                      FormatFixed(result.coarsening_cpu_ms, 0),
                      FormatFixed(result.coarsening_wall_ms, 0)}};
  coarsening.notes = {"The first depth map of the process, into an empty model: " +
                      FormatFixed(result.first_cpu_ms, 0) + " ms of processor time, " +
                      FormatFixed(result.first_wall_ms, 0) + " ms passed. " +
                      count(result.num_exported) + " surfels are exported in " +
                      FormatFixed(result.export_cpu_ms, 0) + " ms of processor time."};
  return {right, wrong, correction, coarsening};
}

Json ToJson(const FusionBenchResult& result) {
  return {{"device", result.device},
          {"width_px", result.width},
          {"height_px", result.height},
          {"surfels", result.num_surfels},
          {"new_surfels_per_map", result.num_new},
          {"refused_maps", result.num_rejected},
          {"map_cpu", ToJson(result.right_cpu_ms)},
          {"map_stages", ToJson(result.right)},
          {"found_error_px", ToJson(result.found_error_px)},
          {"evaluations", ToJson(result.num_evaluations)},
          {"wrong_map_cpu", ToJson(result.wrong_cpu_ms)},
          {"wrong_map_stages", ToJson(result.wrong)},
          {"first_map", {{"cpu_ms", result.first_cpu_ms}, {"wall_ms", result.first_wall_ms}}},
          {"export", {{"surfels", result.num_exported}, {"cpu_ms", result.export_cpu_ms}}},
          {"correction",
           {{"surfels", result.num_corrected},
            {"cpu_ms", result.correction_cpu_ms},
            {"wall_ms", result.correction_wall_ms}}},
          {"merging",
           {{"merged", result.num_merged},
            {"cpu_ms", result.merging_cpu_ms},
            {"stages", ToJson(result.merging)}}},
          {"coarsening",
           {{"surfels_before", result.num_full},
            {"surfels_after", result.num_coarse},
            {"cpu_ms", result.coarsening_cpu_ms},
            {"wall_ms", result.coarsening_wall_ms}}}};
}

}  // namespace mono3d::tools
