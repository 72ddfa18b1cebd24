// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-depth: from five images and their poses to the depth of the middle one.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/version.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::vector<std::string> images;  // or one folder
  std::string camera;
  std::string poses;
  std::string output;
  std::string resize;
  DepthEstimatorOptions depth;
};

// The five images that were named, or those of the one folder or glob that was.
std::vector<Frame> ReadFrames(const Arguments& arguments) {
  std::vector<std::string> images = arguments.images;
  if (images.size() == 1 && !std::filesystem::is_regular_file(images[0])) {
    images = ListImages(images[0]);
  }
  if (images.size() != kBundleSize) {
    throw UsageError(ErrorParts{.what = "wrong number of images",
                                .where = arguments.images[0],
                                .expected = std::to_string(kBundleSize),
                                .found = std::to_string(images.size())});
  }
  FrameSourceOptions options;
  options.resize = arguments.resize;
  const auto source = OpenFrameSource(images, ReadCameraFile(arguments.camera), options);
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = source->Next()) frames.push_back(*std::move(frame));
  return frames;
}

ImageBundle ReadBundle(const Arguments& arguments) {
  const std::vector<Frame> frames = ReadFrames(arguments);
  const std::vector<StampedPose> poses = ReadTrajectory(arguments.poses);
  if (poses.size() != frames.size()) {
    throw Error(ErrorParts{.what = "wrong number of poses",
                           .where = arguments.poses,
                           .expected = std::to_string(frames.size()) + ", one for each image",
                           .found = std::to_string(poses.size())});
  }
  ImageBundle bundle;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Keyframe keyframe;
    keyframe.id = static_cast<std::int64_t>(i);
    keyframe.frame = frames[i];
    keyframe.frame.timestamp_s = poses[i].timestamp_s;
    keyframe.T_world_cam = poses[i].T_world_cam;
    bundle.keyframes.push_back(keyframe);
  }
  return bundle;
}

nlohmann::ordered_json Record(const Arguments& arguments, const Device& device,
                              const DepthResult& result, const std::vector<StageTime>& stages) {
  nlohmann::ordered_json json;
  json["mono3d"] = Version();
  json["device"] = {{"name", Info(device).name}, {"driver", Info(device).driver}};
  DepthEstimatorOptions options = arguments.depth;
  for (const OptionField& field : ListOptions(options)) {
    std::visit([&](const auto* value) { json["options"]["depth." + field.name] = *value; },
               field.value);
  }
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
  const ImageBundle bundle = ReadBundle(arguments);
  const std::filesystem::path folder = arguments.output;
  CreateOutputFolder(folder);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  StageTimes times;
  const DepthResult result =
      CreateDepthEstimator(device, arguments.depth, &times)->Estimate(bundle);
  WriteFileAtomically(folder / "bundle.json",
                      Record(arguments, *device, result, times.Snapshot()).dump(2) + "\n");
  if (result.status != DepthStatus::kEstimated) throw Error("no depth: " + result.reason);
  const std::string name = std::filesystem::path(bundle.reference().frame.name).stem();
  WriteDepthMap(folder, name, result.map);
  WritePly(folder / "cloud.ply", ToPointCloud(result.map));
  std::printf("%s: depth for %.1f %% of the pixels, %d planes between %g and %g\n",
              (folder / (name + ".depth.pfm")).c_str(),
              100.0 * static_cast<double>(CountEstimates(result.map)) /
                  static_cast<double>(result.map.depth.total()),
              result.num_planes, result.min_depth_su, result.max_depth_su);
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-depth",
            "Estimates depth, normals and confidence of the middle one of five images.\n"
            "Example: mono3d-depth 1.jpg 2.jpg 3.jpg 4.jpg 5.jpg --camera camera.yaml "
            "--poses poses.txt -o depth/");
  Arguments arguments;
  CLI::App& app = tool.app();
  app.add_option("IMAGES", arguments.images, "five images in the order of flight, or their folder")
      ->required();
  app.add_option("--camera", arguments.camera,
                 "calibration: OpenCV or ROS camera.yaml, or COLMAP cameras.txt")
      ->required();
  app.add_option("--poses", arguments.poses,
                 "TUM file, camera to world, one line for each image in their order")
      ->required();
  app.add_option("-o,--output", arguments.output,
                 "folder for <middle image>.depth.pfm, .normal.pfm, .confidence.pfm, cloud.ply")
      ->required();
  app.add_option("--resize", arguments.resize, "WIDTHxHEIGHT or \"calibration\"");
  tool.AddOptions(mono3d::ListOptions(arguments.depth), "depth.");
  return tool.Run(argc, argv, [&] { return EstimateDepth(arguments, tool.common().device); });
}
