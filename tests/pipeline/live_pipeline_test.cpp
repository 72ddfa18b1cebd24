// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The chain with depth and fusion in a thread of their own. A depth stage that works only when it
// is told to stands for a slow one, so that what happens meanwhile does not depend on luck.

#include <gmock/gmock.h>

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

Pose At(double x, double y = 0) { return {Eigen::Quaterniond::Identity(), {x, y, 0}}; }

// All keyframes so far are moved to y = 1, and their lengths doubled, each time.
struct Correction {
  std::vector<std::int64_t> at;  // frames, which are no keyframes; -1: in the end
  int into = 0;                  // the map that they belong to from then on
};

// Every frame is a keyframe, which settles at once; it is at x = index.
class StraightTracker final : public Tracker {
 public:
  explicit StraightTracker(Correction correction) : correction_(std::move(correction)) {}
  TrackingResult Track(const Frame& frame) override {
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    const bool is_correction =
        std::count(correction_.at.begin(), correction_.at.end(), frame.index);
    if (is_correction) result.corrections = Corrected();
    result.map_id = map_id_;
    result.T_world_cam = At(static_cast<double>(frame.index), scale_ > 1 ? 1 : 0);
    entries_.push_back({frame.index, frame.timestamp_s, map_id_, *result.T_world_cam});
    if (is_correction) return result;
    result.finalised_keyframes = {{frame.index, map_id_, frame, *result.T_world_cam, {1}}};
    return result;
  }
  std::vector<KeyframeCorrection> WaitForMapping() override {
    const bool is_correction = correction_.at == std::vector<std::int64_t>{-1};
    return is_correction ? Corrected() : std::vector<KeyframeCorrection>{};
  }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override { return entries_; }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return entries_; }

 private:
  std::vector<KeyframeCorrection> Corrected() {
    map_id_ = correction_.into;
    scale_ *= 2;
    std::vector<KeyframeCorrection> corrections;
    for (TrajectoryEntry& entry : entries_) {
      entry.map_id = map_id_;
      entry.T_world_cam = At(static_cast<double>(entry.frame_index), 1);
      corrections.push_back({entry.frame_index, map_id_, entry.T_world_cam, scale_});
    }
    return corrections;
  }
  Correction correction_;
  int map_id_ = 0;
  double scale_ = 1;
  std::vector<TrajectoryEntry> entries_;
};

// Each keyframe is a bundle of its own.
class EverySelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe) override {
    return ImageBundle{{keyframe}};
  }
  void Correct(std::span<const KeyframeCorrection>) override {}
};

// What happens in the other thread, and when it may go on.
class Gate {
 public:
  // In the other thread: says that it is here, and waits until it may go on.
  void Pass() {
    std::unique_lock lock(mutex_);
    ++num_arrived_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return is_open_; });
  }
  void WaitForArrival() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return num_arrived_ > 0; });
  }
  void Open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int num_arrived_ = 0;
  bool is_open_ = false;
};

// Touched by the other thread until Finish has returned.
struct Record {
  Gate gate;
  std::vector<Keyframe> references;  // of the bundles, as they came to the depth stage
  std::vector<std::string> model;    // what was done to it, in order
};

class GatedDepthEstimator final : public DepthEstimator {
 public:
  explicit GatedDepthEstimator(Record* log) : log_(log) {}
  DepthResult Estimate(const ImageBundle& bundle) override {
    log_->gate.Pass();
    const Keyframe& reference = bundle.reference();
    log_->references.push_back(reference);
    DepthResult result;
    result.status = DepthStatus::kEstimated;
    result.map.frame_index = reference.frame.index;
    result.map.keyframe_id = reference.id;
    result.map.map_id = reference.map_id;
    result.map.T_world_cam = reference.T_world_cam;
    return result;
  }

 private:
  Record* log_;
};

class LoggingSurfelMap final : public SurfelMap {
 public:
  explicit LoggingSurfelMap(Record* log) : log_(log) {}
  FusionResult Integrate(const DepthMap& map) override {
    log_->model.push_back("fuse " + std::to_string(map.frame_index));
    FusionResult result;
    result.status = FusionStatus::kFused;
    result.T_world_cam = map.T_world_cam;
    cloud_.points.emplace_back(map.T_world_cam.translation().cast<float>());
    return result;
  }
  CorrectionResult Correct(std::span<const KeyframeCorrection> corrections) override {
    std::string text = "correct";
    for (const KeyframeCorrection& correction : corrections) {
      text += " " + std::to_string(correction.id) + " by " +
              std::to_string(static_cast<int>(correction.scale));
    }
    log_->model.push_back(text);
    return {};
  }
  PointCloud Export(const SurfelExportOptions&) const override { return cloud_; }
  std::int64_t num_surfels() const override { return static_cast<std::int64_t>(cloud_.size()); }

 private:
  Record* log_;
  PointCloud cloud_;
};

PipelineStages Stages(Record* log, Correction correction = {}) {
  PipelineStages stages;
  stages.tracker = std::make_unique<StraightTracker>(std::move(correction));
  stages.keyframe_selector = std::make_unique<EverySelector>();
  stages.depth_estimator = std::make_unique<GatedDepthEstimator>(log);
  stages.create_surfel_map = [log] { return std::make_unique<LoggingSurfelMap>(log); };
  return stages;
}

Frame FrameOf(std::int64_t index) {
  Frame frame;
  frame.index = index;
  frame.timestamp_s = 0.1 * static_cast<double>(index);
  return frame;
}

// Frame 0 sets the depth stage to work; the others come while it is at that.
void ProcessWhileDepthIsBusy(Pipeline& pipeline, Record& log, std::int64_t num_frames) {
  pipeline.Process(FrameOf(0));
  log.gate.WaitForArrival();
  for (std::int64_t i = 1; i < num_frames; ++i) pipeline.Process(FrameOf(i));
  log.gate.Open();
}

TEST(LivePipeline, DropsTheBundlesThatABusyDepthStageCannotTakeButTheNewest) {
  Record log;
  Pipeline pipeline(Stages(&log), {}, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 6);
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 5"));
  EXPECT_EQ(result.counts.num_frames, 6);
  EXPECT_EQ(result.counts.num_bundles, 6);
  EXPECT_EQ(result.counts.num_dropped_bundles, 4);
  EXPECT_EQ(result.counts.num_depth_maps, 2);
  EXPECT_EQ(result.counts.num_fused, 2);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 6U);
  EXPECT_EQ(result.maps[0].model.size(), 2U);
}

TEST(LivePipeline, MovesABundleThatWaitsAfterTheModel) {
  Record log;
  Pipeline pipeline(Stages(&log, {{2}, 0}), {}, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  const Reconstruction result = pipeline.Finish();
  EXPECT_EQ(result.counts.num_corrections, 1);
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "correct 0 by 2", "fuse 1"));
  ASSERT_EQ(log.references.size(), 2U);
  EXPECT_EQ(log.references[1].T_world_cam.translation().y(), 1);
  EXPECT_EQ(log.references[1].sparse_depths_su, std::vector<float>{2});
}

// The frames of a flight that is corrected twice: keyframe 1 waits during the first correction and
// is in the model during the second.
TEST(LivePipeline, TellsTheModelOfScalesSinceItHasTheDepthMap) {
  Record log;
  Gate fused;
  fused.Open();
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
    if (map.frame_index == 1) fused.Pass();
  };
  Pipeline pipeline(Stages(&log, {{2, 3}, 0}), observer, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  fused.WaitForArrival();
  pipeline.Process(FrameOf(3));
  static_cast<void>(pipeline.Finish());
  EXPECT_THAT(log.model,
              ElementsAre("fuse 0", "correct 0 by 2", "fuse 1", "correct 0 by 4 1 by 2"));
}

TEST(LivePipeline, MakesOneModelOfMapsThatAreJoinedMeanwhile) {
  Record log;
  Pipeline pipeline(Stages(&log, {{2}, 7}), {}, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 4);
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 3"));
  EXPECT_EQ(log.references[1].map_id, 7);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].map_id, 7);
  EXPECT_EQ(result.maps[0].model.size(), 2U);
  EXPECT_EQ(result.maps[0].online_trajectory.size(), 4U);
  EXPECT_EQ(result.maps[0].model_trajectory.size(), 2U);
}

TEST(LivePipeline, FinishHandsTheLastCorrectionsDown) {
  Record log;
  Pipeline pipeline(Stages(&log, {{-1}, 7}), {}, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].map_id, 7);
  ASSERT_EQ(result.maps[0].model.size(), 2U);
  for (const Eigen::Vector3f& point : result.maps[0].model.points) EXPECT_EQ(point.y(), 1);
  for (const TrajectoryEntry& entry : result.maps[0].model_trajectory) {
    EXPECT_EQ(entry.T_world_cam.translation().y(), 1);
  }
}

TEST(LivePipeline, HandsOnWhatTheOtherThreadThrowsAndKeepsWhatThereWas) {
  Record log;
  PipelineObserver observer;
  observer.on_depth_map = [](const DepthMap& map, const FusionResult&) {
    if (map.frame_index > 0) throw Error("no space left");
  };
  Pipeline pipeline(Stages(&log), observer, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  EXPECT_THAT([&] { static_cast<void>(pipeline.Finish()); },
              ThrowsMessage<Error>(HasSubstr("no space left")));
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 3U);
  EXPECT_EQ(result.maps[0].model.size(), 2U);
  EXPECT_EQ(result.counts.num_dropped_bundles, 1);
}

TEST(LivePipeline, EndsInTheMiddleOfItsWork) {
  Record log;
  Pipeline pipeline(Stages(&log), {}, {}, PipelineMode::kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
}

}  // namespace
}  // namespace mono3d
