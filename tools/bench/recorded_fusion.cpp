// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/recorded_fusion.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <utility>

#include "mono3d/core/error.h"
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

  FusionResult Integrate(const DepthMap& map) override {
    events_.emplace_back(map);
    return model_->Integrate(map);
  }
  CorrectionResult Correct(std::span<const KeyframeCorrection> corrections) override {
    events_.emplace_back(std::vector(corrections.begin(), corrections.end()));
    return model_->Correct(corrections);
  }
  PointCloud Export(const SurfelExportOptions& options) const override {
    return model_->Export(options);
  }
  std::int64_t num_surfels() const override { return model_->num_surfels(); }

 private:
  std::unique_ptr<SurfelMap> model_;
  std::vector<FusionEvent>& events_;
};

std::int64_t NumMaps(const std::vector<FusionEvent>& events) {
  return std::ranges::count_if(
      events, [](const FusionEvent& event) { return std::holds_alternative<DepthMap>(event); });
}

double MedianDepth(const std::vector<FusionEvent>& events) {
  std::vector<float> depths;
  constexpr int kStep_px = 16;  // some hundred depths of each map tell
  for (const FusionEvent& event : events) {
    const auto* map = std::get_if<DepthMap>(&event);
    if (map == nullptr) continue;
    for (int y = 0; y < map->depth.rows; y += kStep_px) {
      for (int x = 0; x < map->depth.cols; x += kStep_px) {
        if (map->depth.at<float>(y, x) > 0) depths.push_back(map->depth.at<float>(y, x));
      }
    }
  }
  if (depths.empty()) throw Error("no estimate in the depth maps");
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

// By number of the keyframe, so that a correction is off as its depth map is.
Pose Disturbed(const Pose& T_world_cam, std::int64_t keyframe, double sigma_su) {
  std::mt19937 random(static_cast<std::uint32_t>(keyframe) + 1);
  std::normal_distribution<double> error(0, sigma_su);
  const Eigen::Vector3d shift(error(random), error(random), error(random));
  return {T_world_cam.rotation(), T_world_cam.translation() + shift};
}

// The poses of what is in the model, by frame.
class Poses {
 public:
  void Take(const DepthMap& map, const FusionResult& fusion) {
    if (fusion.status == FusionStatus::kFused) {
      poses_[map.frame_index] = {map.timestamp_s, fusion.T_world_cam};
    }
    for (const RetriedMap& retried : fusion.retried) {
      poses_.erase(retried.frame_index);
      if (retried.status != FusionStatus::kFused) continue;
      poses_[retried.frame_index] = {retried.timestamp_s, retried.T_world_cam};
    }
  }
  void Take(const CorrectionResult& correction) {
    for (const MovedView& view : correction.views) {
      const auto known = poses_.find(view.frame_index);
      if (known != poses_.end()) known->second.T_world_cam = view.T_world_cam;
    }
  }
  std::vector<StampedPose> InOrder() const {
    std::vector<StampedPose> poses;
    for (const auto& [frame, pose] : poses_) poses.push_back(pose);
    return poses;
  }

 private:
  std::map<std::int64_t, StampedPose> poses_;
};

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
    if (auto* map = std::get_if<DepthMap>(&event)) {
      map->T_world_cam = Disturbed(map->T_world_cam, map->keyframe_id, sigma_su);
    } else {
      for (KeyframeCorrection& c : std::get<std::vector<KeyframeCorrection>>(event)) {
        c.T_world_cam = Disturbed(c.T_world_cam, c.id, sigma_su);
      }
    }
  }
  return events;
}

FusedRun FuseAgain(const std::vector<FusionEvent>& events, SurfelMap& model,
                   const SurfelExportOptions& surfel_export) {
  FusedRun run;
  Poses poses;
  for (const FusionEvent& event : events) {
    const double start_ms = ProcessCpuMs();
    if (const auto* map = std::get_if<DepthMap>(&event)) {
      const FusionResult fusion = model.Integrate(*map);
      ++run.num_maps;
      const bool is_fused = fusion.status == FusionStatus::kFused;
      run.num_moved += is_fused && fusion.registration.moved ? 1 : 0;
      poses.Take(*map, fusion);
    } else {
      poses.Take(model.Correct(std::get<std::vector<KeyframeCorrection>>(event)));
    }
    run.cpu_ms += ProcessCpuMs() - start_ms;
  }
  run.cpu_ms /= std::max(run.num_maps, 1);
  run.poses = poses.InOrder();
  run.num_fused = static_cast<int>(run.poses.size());
  run.model = model.Export(surfel_export);
  return run;
}

}  // namespace mono3d::tools
