// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The chain with depth and fusion in a thread of their own. A depth stage that works only when it
// is told to stands for a slow one, so that what happens meanwhile does not depend on luck.

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/gate.h"
#include "pipeline/keyframe_table.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

Pose At(double x, double y = 0) { return {Eigen::Quaterniond::Identity(), {x, y, 0}}; }

// All keyframes so far are moved to y = 1, and the world's lengths around them doubled, each time.
struct Correction {
  std::vector<std::int64_t> at;  // frames, which are no keyframes; -1: in the end
  int into = 0;                  // the map that they belong to from then on
};

// Every frame is a keyframe, which is final at once; it is at x = index.
class StraightTracker final : public Tracker {
 public:
  explicit StraightTracker(Correction correction) : correction_(std::move(correction)) {}
  TrackingResult Track(const Frame& frame) override {
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    const bool is_correction =
        std::count(correction_.at.begin(), correction_.at.end(), frame.index) > 0;
    if (is_correction) Correct();
    result.map_id = map_id_;
    result.T_world_cam = At(static_cast<double>(frame.index), scale_ > 1 ? 1 : 0);
    keyframes_.Set(frame.index, map_id_, Similarity(scale_, *result.T_world_cam));
    if (is_correction) return result;
    result.finalised_keyframes = {{frame.index, frame, {1}}};
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  void WaitForMapping() override {
    if (correction_.at == std::vector<std::int64_t>{-1}) Correct();
  }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  void Correct() {
    map_id_ = correction_.into;
    scale_ *= 2;
    for (const KeyframePose& pose : Poses()->poses()) {
      const Pose moved = At(static_cast<double>(pose.keyframe_id), 1);
      keyframes_.Set(pose.keyframe_id, map_id_, Similarity(scale_, moved));
    }
  }
  Correction correction_;
  int map_id_ = 0;
  double scale_ = 1;
  KeyframeTable keyframes_;
};

// Each keyframe is a bundle of its own, with the newest one before it.
class LiveEverySelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    const Keyframe before = std::exchange(before_, keyframe);
    return ImageBundle{{before.id < keyframe.id ? before : keyframe, keyframe, keyframe}, {}};
  }

 private:
  Keyframe before_;
};

// Touched by the other thread until Finish has returned.
struct Record {
  Gate gate;
  std::vector<ImageBundle> bundles;  // as they came to the depth stage
  std::vector<DepthEffort> efforts;  // with which they were worked at
  std::vector<std::string> model;    // what was done to it, in order
};

class GatedDepthEstimator final : public DepthEstimator {
 public:
  explicit GatedDepthEstimator(Record* log) : log_(log) {}
  DepthResult Estimate(const ImageBundle& bundle) override {
    log_->gate.Pass();
    const Keyframe& reference = bundle.reference();
    log_->bundles.push_back(bundle);
    log_->efforts.push_back(effort_);
    DepthResult result;
    result.status = DepthStatus::kEstimated;
    result.map.frame_index = reference.frame.index;
    result.map.keyframe_id = reference.id;
    return result;
  }
  void SetEffort(DepthEffort effort) override { effort_ = effort; }

 private:
  Record* log_;
  DepthEffort effort_ = DepthEffort::kFull;
};

// Its depth maps go where their keyframes are.
class LoggingSurfelMap final : public SurfelMap {
 public:
  explicit LoggingSurfelMap(Record* log) : log_(log) {}
  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override {
    log_->model.push_back("fuse " + std::to_string(map.frame_index));
    FusionResult result;
    result.status = FusionStatus::kFused;
    result.S_world_kf = poses.At(map.keyframe_id).S_world_kf;
    maps_.push_back({map.frame_index, map.timestamp_s, map.keyframe_id, result.S_world_kf});
    return result;
  }
  UpdateResult Update(const KeyframePoses& poses) override {
    std::string text = "move";
    for (FusedDepthMap& map : maps_) {
      const Similarity& S_world_kf = poses.At(map.keyframe_id).S_world_kf;
      const double ratio = S_world_kf.scale() / map.S_world_kf.scale();
      if (ratio == 1) continue;
      text +=
          " " + std::to_string(map.frame_index) + " by " + std::to_string(static_cast<int>(ratio));
      map.S_world_kf = S_world_kf;
    }
    const bool has_moved = text != "move";
    if (has_moved) log_->model.push_back(text);
    return {.has_moved = has_moved};
  }
  std::vector<FusedDepthMap> DepthMaps() const override { return maps_; }
  PointCloud Export(const SurfelExportOptions&) const override {
    PointCloud cloud;
    for (const FusedDepthMap& map : maps_) {
      cloud.points.emplace_back(map.S_world_kf.pose().translation().cast<float>());
    }
    return cloud;
  }
  std::int64_t num_surfels() const override { return static_cast<std::int64_t>(maps_.size()); }

 private:
  Record* log_;
  std::vector<FusedDepthMap> maps_;
};

const PipelineOptions kLive = [] {
  PipelineOptions options;
  options.is_live = true;
  options.live.max_waiting_bundles = 1;
  return options;
}();

PipelineStages Stages(Record* log, Correction correction = {}) {
  PipelineStages stages;
  stages.tracker = std::make_unique<StraightTracker>(std::move(correction));
  stages.keyframe_selector = std::make_unique<LiveEverySelector>();
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
  Pipeline pipeline(Stages(&log), {}, kLive);
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

TEST(LivePipeline, BundlesThatWaitTakeLessWorkBeforeAnyIsDropped) {
  Record log;
  PipelineOptions options = kLive;
  options.live.max_waiting_bundles = 4;
  Pipeline pipeline(Stages(&log), {}, options);
  ProcessWhileDepthIsBusy(pipeline, log, 6);
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 2", "fuse 3", "fuse 4", "fuse 5"));
  EXPECT_EQ(result.counts.num_dropped_bundles, 1);
  // 4, 3, 2, 1 and 0 bundles wait behind each. The next one is estimated while one is fused, so
  // what it may take follows from the bundle before that.
  ASSERT_EQ(log.efforts.size(), 5U);
  EXPECT_EQ(log.efforts[0], DepthEffort::kFull);
  EXPECT_EQ(log.efforts[1], DepthEffort::kFull);
  EXPECT_EQ(log.efforts[2], DepthEffort::kMatchedOnly);
  EXPECT_EQ(log.efforts[3], DepthEffort::kRefinedOnce);
  EXPECT_GE(log.efforts[4], DepthEffort::kRefinedOnce);
  EXPECT_EQ(result.counts.reduced_depth_maps.at("matched only"), 1);
}

// In its reference's own unit, a bundle is what it was, wherever the world of its map has gone.
TEST(LivePipeline, ABundleThatWaitsTakesTheLatestPoses) {
  Record log;
  Pipeline pipeline(Stages(&log, {{2}, 0}), {}, kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 1"));
  ASSERT_EQ(log.bundles.size(), 2U);
  // One su of the world towards keyframe 0 is half a unit of keyframe 1 from then on.
  ASSERT_EQ(log.bundles[1].T_ref_cam.size(), 3U);
  EXPECT_EQ(log.bundles[1].T_ref_cam[0].translation(), Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_EQ(log.bundles[1].reference().sparse_depths_su, std::vector<float>{1});
  ASSERT_EQ(result.maps.size(), 1U);
  for (const TrajectoryEntry& entry : result.maps[0].model_trajectory) {
    EXPECT_EQ(entry.T_world_cam.translation().y(), 1);
  }
}

// The frames of a flight that is corrected twice: keyframe 1 waits during the first correction and
// is in the model during the second.
TEST(LivePipeline, MovesADepthMapFromWhereItWasFused) {
  Record log;
  Gate fused;
  fused.Open();
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
    if (map.frame_index == 1) fused.Pass();
  };
  Pipeline pipeline(Stages(&log, {{2, 3}, 0}), observer, kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  fused.WaitForArrival();
  pipeline.Process(FrameOf(3));
  static_cast<void>(pipeline.Finish());
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 1", "move 0 by 2 1 by 2"));
}

// Of two corrections that come while a depth map is fused, the model needs the latter alone, before
// the next one.
TEST(LivePipeline, TheLatestPosesReplaceThoseThatWait) {
  Record log;
  log.gate.Open();  // depth is at once
  Gate fused;
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
    if (map.frame_index == 0) fused.Pass();
  };
  Pipeline pipeline(Stages(&log, {{2, 3}, 0}), observer, kLive);
  pipeline.Process(FrameOf(0));
  fused.WaitForArrival();
  for (std::int64_t i = 1; i < 4; ++i) pipeline.Process(FrameOf(i));
  fused.Open();
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "move 0 by 4", "fuse 1"));
  EXPECT_EQ(result.counts.num_corrections, 1);
}

// Keyframes 0 and 1 wait in a bundle when keyframe 0 goes to a map of its own.
TEST(LivePipeline, LeavesOutABundleWhoseKeyframesAreNoLongerOfOneMap) {
  class SplittingTracker final : public Tracker {
   public:
    TrackingResult Track(const Frame& frame) override {
      if (frame.index == 2) keyframes_.Set(0, 5, Pose());
      keyframes_.Set(frame.index, 0, At(static_cast<double>(frame.index)));
      TrackingResult result;
      if (frame.index < 2) result.finalised_keyframes = {{frame.index, frame, {1}}};
      return result;
    }
    KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
    std::vector<Keyframe> Finish() override { return {}; }
    std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
    std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

   private:
    KeyframeTable keyframes_;
  };
  Record log;
  PipelineStages stages = Stages(&log);
  stages.tracker = std::make_unique<SplittingTracker>();
  Pipeline pipeline(std::move(stages), {}, kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
  const Reconstruction result = pipeline.Finish();
  EXPECT_EQ(result.counts.num_depth_maps, 1);
  EXPECT_EQ(result.counts.rejected_bundles,
            (std::map<std::string, std::int64_t>{{"its keyframes are not of one map", 1}}));
}

TEST(LivePipeline, MakesOneModelOfMapsThatAreJoinedMeanwhile) {
  Record log;
  Pipeline pipeline(Stages(&log, {{2}, 7}), {}, kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 4);
  const Reconstruction result = pipeline.Finish();
  EXPECT_THAT(log.model, ElementsAre("fuse 0", "fuse 3"));
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].map_id, 7);
  EXPECT_EQ(result.maps[0].model.size(), 2U);
  EXPECT_EQ(result.maps[0].online_trajectory.size(), 4U);
  EXPECT_EQ(result.maps[0].model_trajectory.size(), 2U);
}

TEST(LivePipeline, FinishHandsTheLastCorrectionsDown) {
  Record log;
  Pipeline pipeline(Stages(&log, {{-1}, 7}), {}, kLive);
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
  Pipeline pipeline(Stages(&log), observer, kLive);
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
  Pipeline pipeline(Stages(&log), {}, kLive);
  ProcessWhileDepthIsBusy(pipeline, log, 3);
}

}  // namespace
}  // namespace mono3d
