// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/recorded_fusion.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/core/timing.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"

namespace mono3d::tools {
namespace {

// Hands everything on and keeps what it was asked.
class RecordingSurfelMap : public SurfelMap {
 public:
  RecordingSurfelMap(std::unique_ptr<SurfelMap> model, std::vector<FusionEvent>& events)
      : model_(std::move(model)), events_(events) {}

  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override {
    events_.push_back({poses, map});
    return model_->Integrate(map, poses);
  }
  UpdateResult Update(const KeyframePoses& poses) override {
    events_.push_back({poses, {}});
    return model_->Update(poses);
  }
  std::vector<FusedDepthMap> DepthMaps() const override { return model_->DepthMaps(); }
  PointCloud Export(const SurfelExportOptions& options) const override {
    return model_->Export(options);
  }
  std::int64_t num_surfels() const override { return model_->num_surfels(); }

 private:
  std::unique_ptr<SurfelMap> model_;
  std::vector<FusionEvent>& events_;
};

std::int64_t NumMaps(const std::vector<FusionEvent>& events) {
  return std::ranges::count_if(events,
                               [](const FusionEvent& event) { return event.map.has_value(); });
}

// In the unit of the world.
double MedianDepth(const std::vector<FusionEvent>& events) {
  std::vector<double> depths;
  constexpr int kStep_px = 16;  // some hundred depths of each map tell
  for (const FusionEvent& event : events) {
    if (!event.map) continue;
    const cv::Mat& depth = event.map->depth;
    const double scale = event.poses.At(event.map->keyframe_id).S_world_kf.scale();
    for (int y = 0; y < depth.rows; y += kStep_px) {
      for (int x = 0; x < depth.cols; x += kStep_px) {
        if (depth.at<float>(y, x) > 0) depths.push_back(scale * depth.at<float>(y, x));
      }
    }
  }
  if (depths.empty()) throw Error("no estimate in the depth maps");
  return UpperMedian(std::move(depths));
}

// By number of the keyframe, so that it is off alike in all poses of the tracker.
Similarity Disturbed(const KeyframePose& keyframe, double sigma_su) {
  std::mt19937 random(static_cast<std::uint32_t>(keyframe.keyframe_id) + 1);
  std::normal_distribution<double> error(0, sigma_su);
  const Eigen::Vector3d shift(error(random), error(random), error(random));
  const Pose& pose = keyframe.T_world_cam();
  return {keyframe.S_world_kf.scale(), Pose(pose.rotation(), pose.translation() + shift)};
}

}  // namespace

std::vector<FusionEvent> RecordFusion(const std::string& folder, const PipelineOptions& options,
                                      const std::shared_ptr<Device>& device) {
  const CameraModel camera = ReadCameraFile((std::filesystem::path(folder) / "camera.yaml"));
  const auto source = OpenFrameSource(folder, camera);
  std::vector<std::unique_ptr<std::vector<FusionEvent>>> records;
  PipelineStages stages = CreateStages(options, device);
  stages.create_surfel_map = [&records, create = std::move(stages.create_surfel_map)] {
    records.push_back(std::make_unique<std::vector<FusionEvent>>());
    return std::make_unique<RecordingSurfelMap>(create(), *records.back());
  };
  (void)Pipeline(std::move(stages)).Run(*source);
  std::vector<FusionEvent> most;
  for (const auto& record : records) {
    if (NumMaps(*record) > NumMaps(most)) most = std::move(*record);
  }
  if (NumMaps(most) == 0) {
    throw Error(ErrorParts{.what = "no depth map", .where = folder, .expected = {}, .found = {}});
  }
  return most;
}

std::vector<FusionEvent> WithPoseErrors(std::vector<FusionEvent> events, double share) {
  const double sigma_su = share * MedianDepth(events) / std::sqrt(3.0);
  for (FusionEvent& event : events) {
    std::vector<KeyframePose> poses(event.poses.poses().begin(), event.poses.poses().end());
    for (KeyframePose& pose : poses) pose.S_world_kf = Disturbed(pose, sigma_su);
    event.poses = KeyframePoses(event.poses.version(), std::move(poses));
  }
  return events;
}

FusedRun FuseAgain(const std::vector<FusionEvent>& events, SurfelMap& model,
                   const SurfelExportOptions& surfel_export) {
  FusedRun run;
  for (const FusionEvent& event : events) {
    const double start_ms = ProcessCpuMs();
    if (event.map) {
      const FusionResult fusion = model.Integrate(*event.map, event.poses);
      ++run.num_maps;
      const bool is_fused = fusion.status == FusionStatus::kFused;
      run.num_moved += is_fused && fusion.registration.moved ? 1 : 0;
    } else {
      (void)model.Update(event.poses);
    }
    run.cpu_ms += ProcessCpuMs() - start_ms;
  }
  run.cpu_ms /= std::max(run.num_maps, 1);
  for (const FusedDepthMap& map : model.DepthMaps()) {
    run.poses.push_back({map.timestamp_s, map.S_world_kf.pose()});
  }
  run.num_fused = static_cast<int>(run.poses.size());
  run.model = model.Export(surfel_export);
  return run;
}

}  // namespace mono3d::tools
