// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/depth_bench.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "bench/true_bundles.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

constexpr int kSgbmDisparities = 128;
constexpr int kSgbmBlock = 5;

ImageBundle ReadBundle(const DepthBenchOptions& options) {
  const std::filesystem::path folder = options.folder;
  const std::vector<std::string> images = ListImages(options.folder);
  const std::string poses_file =
      options.poses.empty() ? (folder / "groundtruth.txt").string() : options.poses;
  const std::vector<StampedPose> poses = ReadTrajectory(poses_file);
  if (poses.size() != images.size()) {
    throw Error(ErrorParts{.what = "wrong number of poses",
                           .where = poses_file,
                           .expected = std::to_string(images.size()) + ", one for each image",
                           .found = std::to_string(poses.size())});
  }
  const int num_images = static_cast<int>(images.size());
  const int reference = options.reference < 0 ? num_images / 2 : options.reference;
  const int reach = options.num_images / 2 * options.step;
  if (options.step < 1 || reference < reach || reference + reach >= num_images) {
    throw Error(ErrorParts{
        .what = "the images of the bundle leave the sequence",
        .where = options.folder,
        .expected = "images 0 to " + std::to_string(num_images - 1),
        .found = std::to_string(reference - reach) + " to " + std::to_string(reference + reach)});
  }
  FrameSourceOptions source_options;
  source_options.resize = options.resize;
  ImageBundle bundle;
  std::vector<std::string> chosen;
  std::vector<Pose> T_world_cam;
  for (int i = -reach; i <= reach; i += options.step) {
    const auto index = static_cast<std::size_t>(reference + i);
    chosen.push_back(images[index]);
    Keyframe keyframe;
    keyframe.id = static_cast<std::int64_t>(bundle.keyframes.size());
    T_world_cam.push_back(poses[index].T_world_cam);
    bundle.keyframes.push_back(keyframe);
  }
  SetPoses(T_world_cam, bundle);
  const auto source =
      OpenFrameSource(chosen, ReadCameraFile((folder / "camera.yaml").string()), source_options);
  for (Keyframe& keyframe : bundle.keyframes) keyframe.frame = source->Next().value();
  return bundle;
}

// The middle image and the next one, as they are: what it costs does not depend on what they show.
double SgbmCpuMs(const ImageBundle& bundle) {
  cv::Mat left, right, disparity;
  const std::size_t middle = bundle.reference_index();
  cv::cvtColor(bundle.keyframes[middle].frame.bgr, left, cv::COLOR_BGR2GRAY);
  cv::cvtColor(bundle.keyframes[middle + 1].frame.bgr, right, cv::COLOR_BGR2GRAY);
  constexpr int kArea = kSgbmBlock * kSgbmBlock;
  const auto matcher =
      cv::StereoSGBM::create(0, kSgbmDisparities, kSgbmBlock, 8 * kArea, 32 * kArea);
  matcher->setMode(cv::StereoSGBM::MODE_HH);
  const double start_ms = ProcessCpuMs();
  matcher->compute(left, right, disparity);
  return ProcessCpuMs() - start_ms;
}

struct TimedMap {
  DepthMap map;
  double cpu_ms = 0;
};

TimedMap Estimate(DepthEstimator& estimator, const ImageBundle& bundle) {
  const double start_ms = ProcessCpuMs();
  DepthResult result = estimator.Estimate(bundle);
  const double cpu_ms = ProcessCpuMs() - start_ms;
  if (result.status != DepthStatus::kEstimated) throw Error("no depth: " + result.reason);
  return {std::move(result.map), cpu_ms};
}

}  // namespace

DepthBenchResult BenchDepth(const DepthBenchOptions& options, const DeviceOptions& device_options) {
  options.depth.Validate();
  RequireOption(IsBundleSize(static_cast<std::size_t>(std::max(options.num_images, 0))), "images",
                kBundleSizesText, options.num_images);
  ImageBundle bundle = ReadBundle(options);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  StageTimes times;
  const auto estimator = CreateDepthEstimator(device, options.depth, &times);
  DepthBenchResult result;
  result.device = Info(*device).name;
  result.num_images = options.num_images;
  result.width = bundle.reference().frame.camera.width;
  result.height = bundle.reference().frame.camera.height;
  // The first map, of bare poses, has to look for the range of depths; those of the chain know it
  // from the tracker.
  const TimedMap first = Estimate(*estimator, bundle);
  result.first_cpu_ms = first.cpu_ms;
  bundle.keyframes[bundle.reference_index()].sparse_depths_su = SparseDepths(first.map.depth);
  StageDifferences stages;
  stages.Skip(times.Snapshot());
  if (options.compare) SgbmCpuMs(bundle);  // warm
  std::vector<double> cpu_ms, sgbm_cpu_ms;
  for (int i = 0; i < options.num_repeats; ++i) {
    cpu_ms.push_back(Estimate(*estimator, bundle).cpu_ms);
    stages.Add(times.Snapshot());
    if (options.compare) sgbm_cpu_ms.push_back(SgbmCpuMs(bundle));
  }
  result.cpu_ms = SpreadOf(cpu_ms);
  result.sgbm_cpu_ms = SpreadOf(sgbm_cpu_ms);
  result.stages = stages.Stages();
  return result;
}

Table ToTable(const DepthBenchResult& result) {
  Table table;
  table.title = "Depth of " + std::to_string(result.num_images) + " images of " +
                std::to_string(result.width) + " x " + std::to_string(result.height) + " on " +
                result.device;
  table.columns = {"", "least ms", "median ms"};
  const auto add = [&](const std::string& name, const Spread& ms) {
    table.rows.push_back({name, FormatFixed(ms.least, 1), FormatFixed(ms.median, 1)});
  };
  for (const StageSpread& stage : result.stages) add(stage.name, stage.device_ms);
  add("process CPU, one map", result.cpu_ms);
  if (result.sgbm_cpu_ms.least > 0) add("process CPU, one StereoSGBM", result.sgbm_cpu_ms);
  table.notes = {"The first map took " + FormatFixed(result.first_cpu_ms, 0) +
                 " ms of CPU. Stages are timed by the device's clock: on a CPU device busy with "
                 "other programs they look slower than they are."};
  if (result.sgbm_cpu_ms.least > 0) {
    table.notes.push_back("A map takes " + FormatFixed(result.RatioToSgbm(), 2) +
                          " times the CPU of OpenCV's StereoSGBM (MODE_HH, " +
                          std::to_string(kSgbmDisparities) + " disparities, one pair).");
  }
  return table;
}

Json ToJson(const DepthBenchResult& result) {
  Json json = {{"device", result.device},
               {"num_images", result.num_images},
               {"width_px", result.width},
               {"height_px", result.height},
               {"first_map_cpu_ms", result.first_cpu_ms},
               {"map_cpu", ToJson(result.cpu_ms)}};
  if (result.sgbm_cpu_ms.least > 0) {
    json["stereo_sgbm_cpu"] = ToJson(result.sgbm_cpu_ms);
    json["ratio_to_stereo_sgbm"] = result.RatioToSgbm();
  }
  for (const StageSpread& stage : result.stages) {
    json["stages"][stage.name] = ToJson(stage.device_ms);
  }
  return json;
}

}  // namespace mono3d::tools
