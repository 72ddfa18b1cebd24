// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "pipeline/keyframe_table.h"

namespace mono3d {

// Stages for a live pipeline that do as little as possible, and what a script says besides.

inline CameraModel TinyCamera() {
  return {.width = 6, .height = 4, .fx = 5, .fy = 5, .cx = 2.5, .cy = 2};
}

// All pixels have the frame's number as their value.
inline Frame NumberedFrame(std::int64_t index) {
  return {index, 0.1 * static_cast<double>(index), "frame" + std::to_string(index),
          cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(static_cast<double>(index))), TinyCamera()};
}

// What the stages do besides their work.
struct LiveScript {
  std::function<void(const Frame&)> on_track = [](const Frame&) {};
  std::function<void(const ImageBundle&)> on_estimate = [](const ImageBundle&) {};
};

// Every frame is a keyframe at x = index, final one frame later: the tracker keeps its image.
class KeepingTracker final : public Tracker {
 public:
  explicit KeepingTracker(const LiveScript* script) : script_(script) {}
  TrackingResult Track(const Frame& frame) override {
    script_->on_track(frame);
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    const Pose T_world_cam(Eigen::Quaterniond::Identity(),
                           Eigen::Vector3d(static_cast<double>(frame.index), 0, 0));
    result.T_world_cam = T_world_cam;
    result.pose = FramePose{frame.index, frame.timestamp_s, frame.index, Pose()};
    {
      const std::lock_guard lock(mutex_);
      keyframes_.Set(frame.index, 0, T_world_cam);
    }
    if (pending_) result.finalised_keyframes = {*pending_};
    pending_ = Keyframe{frame.index, frame, {1}};
    return result;
  }
  KeyframePosesPtr Poses() const override {
    const std::lock_guard lock(mutex_);
    return keyframes_.Poses();
  }
  std::vector<Keyframe> Finish() override {
    const std::optional<Keyframe> last = std::exchange(pending_, std::nullopt);
    return last ? std::vector<Keyframe>{*last} : std::vector<Keyframe>{};
  }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  const LiveScript* script_;
  mutable std::mutex mutex_;
  KeyframeTable keyframes_;
  std::optional<Keyframe> pending_;
};

// Each keyframe is a bundle of its own.
class SingleSelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    return ImageBundle{{keyframe}, {}};
  }
};

class ScriptedEstimator final : public DepthEstimator {
 public:
  explicit ScriptedEstimator(const LiveScript* script) : script_(script) {}
  DepthResult Estimate(const ImageBundle& bundle) override {
    script_->on_estimate(bundle);
    DepthResult result;
    result.status = DepthStatus::kEstimated;
    result.map.keyframe_id = bundle.reference().id;
    result.map.frame_index = bundle.reference().frame.index;
    return result;
  }

 private:
  const LiveScript* script_;
};

// A surfel per depth map.
class CountingSurfelMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override {
    FusionResult result;
    result.status = FusionStatus::kFused;
    result.S_world_kf = poses.At(map.keyframe_id).S_world_kf;
    maps_.push_back({map.frame_index, map.timestamp_s, map.keyframe_id, result.S_world_kf});
    return result;
  }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return maps_; }
  SurfelChanges ChangesSince(std::uint64_t version) override {
    SurfelChanges changes;
    changes.version = maps_.size();
    for (std::uint32_t i = 0; i < maps_.size(); ++i) {
      changes.anchors.push_back(
          {i, maps_[i].keyframe_id, maps_[i].frame_index, maps_[i].S_world_kf});
      if (i >= version) changes.changed.push_back({i, std::make_shared<PointCloud>(OneSurfel())});
    }
    return changes;
  }
  PointCloud Export(const SurfelExportOptions&) const override {
    PointCloud cloud;
    for (const FusedDepthMap& map : maps_) {
      cloud.points.emplace_back(map.S_world_kf.pose().translation().cast<float>());
    }
    return cloud;
  }
  std::int64_t num_surfels() const override { return static_cast<std::int64_t>(maps_.size()); }

 private:
  // Two units before the camera of its depth map.
  static PointCloud OneSurfel() {
    PointCloud cloud;
    cloud.points = {{0, 0, 2}};
    cloud.normals = {{0, 0, -1}};
    cloud.colours = {{1, 2, 3}};
    cloud.radii = {0.5F};
    cloud.confidences = {0.5F};
    cloud.observations = {1};
    return cloud;
  }

  std::vector<FusedDepthMap> maps_;
};

}  // namespace mono3d
