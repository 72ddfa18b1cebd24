// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-depth: from a few images, with poses or without, to the depth of the middle one.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "common/tool.h"
#include "depth/bundle_input.h"
#include "mono3d/core/error.h"
#include "mono3d/core/version.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  BundleInput input;
  std::string output;
  DepthEstimatorOptions depth;
};

nlohmann::ordered_json Record(const Arguments& arguments, const Device& device,
                              const PosedBundle& posed, const DepthResult& result,
                              const std::vector<StageTime>& stages) {
  nlohmann::ordered_json json;
  json["mono3d"] = Version();
  json["device"] = {{"name", Info(device).name}, {"driver", Info(device).driver}};
  Arguments options = arguments;
  for (const OptionField& field : ListOptions(options.depth)) {
    std::visit([&](const auto* value) { json["options"]["depth." + field.name] = *value; },
               field.value);
  }
  for (const OptionField& field : ListOptions(options.input.estimation)) {
    std::visit([&](const auto* value) { json["options"]["poses." + field.name] = *value; },
               field.value);
  }
  json["poses"] = PosesRecord(arguments.input, posed);
  json["status"] = result.status == DepthStatus::kEstimated ? "estimated" : "rejected";
  if (!result.reason.empty()) json["reason"] = result.reason;
  json["level"] = result.level;
  json["planes"] = result.num_planes;
  json["min_depth"] = result.min_depth_su;
  json["max_depth"] = result.max_depth_su;  // null: at infinity
  if (!result.map.depth.empty()) {
    json["pixels"] = result.map.depth.total();
    json["estimates"] = CountEstimates(result.map);
  }
  for (const StageTime& stage : stages) {
    json["stages"][stage.stage] = {{"wall_ms", stage.wall_ms}, {"gpu_ms", stage.gpu_ms}};
  }
  return json;
}

int EstimateDepth(const Arguments& arguments, const DeviceOptions& device_options) {
  arguments.depth.Validate();
  arguments.input.estimation.Validate();
  StageTimes times;
  const PosedBundle posed = ReadBundle(arguments.input, &times);
  const ImageBundle& bundle = posed.bundle;
  const std::filesystem::path folder = arguments.output;
  CreateOutputFolder(folder);
  if (posed.estimation) WriteEstimation(folder, posed);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  const DepthResult result =
      CreateDepthEstimator(device, arguments.depth, &times)->Estimate(bundle);
  WriteFileAtomically(folder / "bundle.json",
                      JsonText(Record(arguments, *device, posed, result, times.Snapshot())));
  if (result.status != DepthStatus::kEstimated) throw Error("no depth: " + result.reason);
  const std::string name = std::filesystem::path(bundle.reference().frame.name).stem();
  WriteDepthMap(folder, name, result.map);
  const Similarity& S_world_kf = posed.poses.At(result.map.keyframe_id).S_world_kf;
  WritePly(folder / "cloud.ply", ToPointCloud(result.map, S_world_kf));
  std::printf("%s: depth for %.1f %% of the pixels, %d planes between %g and %g\n",
              (folder / (name + ".depth.pfm")).c_str(),
              100.0 * static_cast<double>(CountEstimates(result.map)) /
                  static_cast<double>(result.map.depth.total()),
              result.num_planes, result.min_depth_su, result.max_depth_su);
  if (posed.estimation) {
    std::printf("poses estimated from %zu points, reprojection error %.2f px\n",
                posed.estimation->model.points.size(), posed.estimation->reprojection_px);
  }
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-depth",
            "Estimates depth, normals and confidence of the middle one of 3, 5, 7 or 9 images.\n"
            "Example: mono3d-depth 1.jpg 2.jpg 3.jpg 4.jpg 5.jpg --camera camera.yaml -o depth/");
  Arguments arguments;
  CLI::App& app = tool.app();
  app.add_option("IMAGES", arguments.input.images,
                 "3, 5, 7 or 9 images in the order of flight, or their folder")
      ->required();
  app.add_option("--camera", arguments.input.camera,
                 "calibration: OpenCV or ROS camera.yaml, or COLMAP cameras.txt")
      ->required();
  app.add_option("--poses", arguments.input.poses,
                 "TUM file, camera to world, one line for each image in their order, or COLMAP "
                 "text model; without it the poses are estimated from the images");
  app.add_option("-o,--output", arguments.output,
                 "folder for <middle image>.depth.pfm, .normal.pfm, .confidence.pfm, cloud.ply")
      ->required();
  app.add_option("--resize", arguments.input.resize, "WIDTHxHEIGHT or \"calibration\"");
  tool.AddOptions(mono3d::ListOptions(arguments.depth), "depth.");
  tool.AddOptions(mono3d::ListOptions(arguments.input.estimation), "poses.");
  return tool.Run(argc, argv, [&] { return EstimateDepth(arguments, tool.common().device); });
}
