// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/pipeline.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "pipeline/keyframe_table.h"

namespace mono3d {
namespace {

// Stages that do as little as the interfaces allow, so that the chain alone is under test.

// Frame i is keyframe i at x = i; at frame 8 keyframe 1 is raised; frames 10 to 12 are lost; 13
// begins map 1, and 12 gets its pose then. A keyframe is final one frame late.
class FakeTracker : public Tracker {
 public:
  TrackingResult Track(const Frame& frame) override {
    TrackingResult result;
    const bool is_lost = frame.index >= 10 && frame.index <= 12;
    if (is_lost) {
      result.status = TrackingStatus::kLost;
      result.reason = std::to_string(frame.index) + " matches, 15 needed";
      return result;
    }
    result.status = TrackingStatus::kTracking;
    result.map_id = frame.index > 12 ? 1 : 0;
    const Eigen::Vector3d position_su(static_cast<double>(frame.index), 0, 0);
    result.T_world_cam = Pose(Eigen::Quaterniond::Identity(), position_su);
    keyframes_.Set(frame.index, result.map_id, *result.T_world_cam);
    if (frame.index == 8) {
      keyframes_.Set(1, 0, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 50)));
    }
    if (frame.index == 13) {
      result.recovered = {{12, frame.timestamp_s - 1, 13, Pose()}};
      keyframes_.Set(12, 1, *result.T_world_cam);
    }
    if (pending_) result.finalised_keyframes.push_back(*std::exchange(pending_, std::nullopt));
    pending_ = Keyframe{frame.index, frame, {1}};
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  std::vector<Keyframe> Finish() override {
    return pending_ ? std::vector<Keyframe>{*pending_} : std::vector<Keyframe>{};
  }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 protected:
  KeyframeTable keyframes_;

 private:
  std::optional<Keyframe> pending_;
};

// Each keyframe is a bundle of its own.
class FakeSelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    return ImageBundle{{keyframe}, {}};
  }
};

// Every third bundle has no depth in it.
class FakeDepthEstimator final : public DepthEstimator {
 public:
  DepthResult Estimate(const ImageBundle& bundle) override {
    EXPECT_EQ(bundle.T_ref_cam.size(), 1U);
    DepthResult result;
    const Keyframe& reference = bundle.reference();
    if (reference.id % 3 == 0) {
      result.reason = "no texture";
      return result;
    }
    result.status = DepthStatus::kEstimated;
    result.map.keyframe_id = reference.id;
    result.map.frame_index = reference.frame.index;
    return result;
  }
};

struct MapLog {
  int num_maps = 0;
  std::vector<int> min_observations;
  std::int64_t frame_without_memory = -1;
  bool has_memory_to_export = true;
};

// One surfel a depth map; the depth map of frame 4 is rejected.
class FakeSurfelMap final : public SurfelMap {
 public:
  explicit FakeSurfelMap(MapLog* log) : log_(log) { ++log_->num_maps; }
  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override {
    FusionResult result;
    if (map.frame_index == log_->frame_without_memory) throw std::bad_alloc();
    if (map.frame_index == 4) {
      result.reason = "no overlap";
      return result;
    }
    result.status = FusionStatus::kFused;
    result.S_world_kf = poses.At(map.keyframe_id).S_world_kf;
    maps_.push_back({map.frame_index, map.timestamp_s, map.keyframe_id, result.S_world_kf});
    cloud_.points.emplace_back(result.S_world_kf.pose().translation().cast<float>());
    return result;
  }
  // Its depth maps go where their keyframes are.
  UpdateResult Update(const KeyframePoses& poses) override {
    UpdateResult result;
    for (FusedDepthMap& map : maps_) {
      const Similarity& S_world_kf = poses.At(map.keyframe_id).S_world_kf;
      const Eigen::Vector3d& before = map.S_world_kf.pose().translation();
      if (S_world_kf.pose().translation() == before) continue;
      result.has_moved = true;
      map.S_world_kf = S_world_kf;
    }
    return result;
  }
  std::vector<FusedDepthMap> DepthMaps() const override { return maps_; }
  PointCloud Export(const SurfelExportOptions& options) const override {
    log_->min_observations.push_back(options.min_observations);
    if (!log_->has_memory_to_export) throw std::bad_alloc();
    return cloud_;
  }
  std::int64_t num_surfels() const override { return static_cast<std::int64_t>(cloud_.size()); }
  SurfelChanges ChangesSince(std::uint64_t) override {
    SurfelChanges changes;
    changes.version = cloud_.size();
    changes.anchors.push_back({0, 0, 0, Similarity()});
    auto cloud = std::make_shared<PointCloud>(cloud_);
    cloud->normals.resize(cloud->size());
    cloud->colours.resize(cloud->size());
    cloud->radii.resize(cloud->size());
    cloud->confidences.assign(cloud->size(), 1);
    cloud->observations.resize(cloud->size());
    changes.changed.push_back({0, std::move(cloud)});
    return changes;
  }

 private:
  MapLog* log_;
  std::vector<FusedDepthMap> maps_;
  PointCloud cloud_;
};

PipelineStages FakeStages(MapLog* log) {
  PipelineStages stages;
  stages.tracker = std::make_unique<FakeTracker>();
  stages.keyframe_selector = std::make_unique<FakeSelector>();
  stages.depth_estimator = std::make_unique<FakeDepthEstimator>();
  stages.create_surfel_map = [log] { return std::make_unique<FakeSurfelMap>(log); };
  return stages;
}

class FakeSource final : public FrameSource {
 public:
  explicit FakeSource(int num_frames) : num_frames_(num_frames) {}
  std::optional<Frame> Next() override {
    if (next_ == num_frames_) return std::nullopt;
    Frame frame;
    frame.index = next_;
    frame.timestamp_s = 0.1 * next_;
    ++next_;
    return frame;
  }
  std::optional<std::int64_t> num_frames() const override { return num_frames_; }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return camera_; }

 private:
  int num_frames_;
  int next_ = 0;
  CameraModel camera_;
};

TEST(Pipeline, CountsWhatBecameOfEveryFrameBundleAndDepthMap) {
  MapLog log;
  FakeSource source(16);
  const Reconstruction result = Pipeline(FakeStages(&log)).Run(source);
  const PipelineCounts& counts = result.counts;
  EXPECT_EQ(counts.num_frames, 16);
  EXPECT_EQ(counts.num_tracked, 13);
  EXPECT_EQ(counts.num_recovered, 1);
  EXPECT_EQ(counts.num_keyframes, 13);  // the last one comes out of Finish
  EXPECT_EQ(counts.num_bundles, 13);
  EXPECT_EQ(counts.num_depth_maps, 8);  // not 0, 3, 6, 9, 15
  EXPECT_EQ(counts.num_fused, 7);       // not 4
  // Reasons that differ in their figures alone are counted together.
  EXPECT_EQ(counts.untracked_frames,
            (std::map<std::string, std::int64_t>{{"10 to 12 matches, 15 needed", 3}}));
  EXPECT_EQ(counts.rejected_bundles, (std::map<std::string, std::int64_t>{{"no texture", 5}}));
  EXPECT_EQ(counts.rejected_depth_maps, (std::map<std::string, std::int64_t>{{"no overlap", 1}}));
}

// Frames are looked at together, at the end: frame i is keyframe i at x = i, but for 2 and 7.
class LateTracker final : public Tracker {
 public:
  TrackingResult Track(const Frame& frame) override {
    frames_.push_back(frame);
    TrackingResult result;
    result.is_pending = true;
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  std::vector<Keyframe> Finish() override {
    std::vector<Keyframe> keyframes;
    for (const Frame& frame : frames_) {
      if (frame.index == 2 || frame.index == 7) {
        late_.push_back({frame.index, std::nullopt, "shows something else"});
        continue;
      }
      const Eigen::Vector3d position_su(static_cast<double>(frame.index), 0, 0);
      keyframes_.Set(frame.index, 0, Pose(Eigen::Quaterniond::Identity(), position_su));
      keyframes.push_back({frame.index, frame, {1}});
      late_.push_back(
          {frame.index, FramePose{frame.index, frame.timestamp_s, frame.index, Pose()}, {}});
    }
    return keyframes;
  }
  std::vector<LateResult> LateResults() const override { return late_; }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  std::vector<Frame> frames_;
  std::vector<LateResult> late_;
  KeyframeTable keyframes_;
};

TEST(Pipeline, TakesFramesThatArePlacedAtTheEnd) {
  MapLog log;
  PipelineStages stages = FakeStages(&log);
  stages.tracker = std::make_unique<LateTracker>();
  FakeSource source(10);
  const Reconstruction result = Pipeline(std::move(stages)).Run(source);
  EXPECT_EQ(result.counts.num_frames, 10);
  EXPECT_EQ(result.counts.num_tracked, 0);
  EXPECT_EQ(result.counts.num_recovered, 8);
  EXPECT_EQ(result.counts.num_keyframes, 8);
  EXPECT_EQ(result.counts.untracked_frames,
            (std::map<std::string, std::int64_t>{{"shows something else", 2}}));
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 8U);
  EXPECT_EQ(result.maps[0].online_trajectory.size(), 8U);
  EXPECT_EQ(result.counts.num_fused, 3);  // 1, 5 and 8; 4 was rejected, 0 3 6 9 have no depth
}

// The poses that were found stay.
TEST(Pipeline, StoppedMakesNoMoreDepthMapsOfPhotographs) {
  MapLog log;
  PipelineStages stages = FakeStages(&log);
  stages.tracker = std::make_unique<LateTracker>();
  std::atomic<bool> stop = false;
  PipelineOptions options;
  options.are_photos = true;
  options.photos.stop = &stop;
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap&, const FusionResult&) { stop = true; };
  FakeSource source(10);
  const Reconstruction result = Pipeline(std::move(stages), observer, options).Run(source);
  EXPECT_EQ(result.counts.num_fused, 1);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 8U);
}

TEST(Pipeline, TheTrajectoryOfTheModelFollowsItsKeyframes) {
  MapLog log;
  FakeSource source(16);
  const Reconstruction result = Pipeline(FakeStages(&log)).Run(source);
  EXPECT_EQ(result.counts.num_corrections, 1);
  const auto& entries = result.maps[0].model_trajectory;
  ASSERT_EQ(entries.size(), 5U);
  EXPECT_EQ(entries[0].frame_index, 1);
  EXPECT_EQ(entries[0].T_world_cam.translation().z(), 50);
  EXPECT_EQ(entries[1].T_world_cam.translation().z(), 0);
}

TEST(Pipeline, KeepsTheMapsOfTheTrackerApartAndTheLongestFirst) {
  MapLog log;
  FakeSource source(16);
  const Reconstruction result = Pipeline(FakeStages(&log)).Run(source);
  ASSERT_EQ(result.maps.size(), 2U);
  EXPECT_EQ(log.num_maps, 2);
  EXPECT_EQ(result.maps[0].map_id, 0);
  EXPECT_EQ(result.maps[0].trajectory.size(), 10U);
  EXPECT_EQ(result.maps[0].online_trajectory.size(), 10U);
  EXPECT_EQ(result.maps[0].model.size(), 5U);  // frames 1 2 5 7 8
  EXPECT_EQ(result.maps[0].model_trajectory.size(), 5U);
  EXPECT_EQ(result.maps[1].map_id, 1);
  EXPECT_EQ(result.maps[1].trajectory.size(), 4U);
  ASSERT_EQ(result.maps[1].online_trajectory.size(), 4U);
  EXPECT_EQ(result.maps[1].online_trajectory[0].frame_index, 12);  // in order of time
  EXPECT_EQ(result.maps[1].online_trajectory[1].frame_index, 13);
  EXPECT_EQ(result.maps[1].model.size(), 2U);  // frames 13 14
}

// The same flight, but frame 15 sees that map 1 is map 0, moved by 100 in y.
class JoiningTracker final : public FakeTracker {
 public:
  TrackingResult Track(const Frame& frame) override {
    TrackingResult result = FakeTracker::Track(frame);
    if (frame.index < 15) return result;
    const Pose moved(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 100, 0));
    keyframes_.Join(1, 0, Similarity(1, moved));
    result.map_id = 0;
    result.T_world_cam = moved * *result.T_world_cam;
    result.finalised_keyframes.clear();
    return result;
  }
  std::vector<Keyframe> Finish() override { return {}; }
};

TEST(Pipeline, MakesOneModelOfMapsThatWereJoined) {
  MapLog log;
  PipelineStages stages = FakeStages(&log);
  stages.tracker = std::make_unique<JoiningTracker>();
  FakeSource source(16);
  const Reconstruction result = Pipeline(std::move(stages)).Run(source);
  ASSERT_EQ(result.maps.size(), 1U);
  const MapReconstruction& map = result.maps[0];
  EXPECT_EQ(map.map_id, 0);
  EXPECT_EQ(map.trajectory.size(), 14U);
  EXPECT_EQ(map.online_trajectory.size(), 14U);
  ASSERT_EQ(map.model.size(), 6U);  // frames 1 2 5 7 8 of map 0, 13 of map 1
  EXPECT_EQ(map.model.points[5], Eigen::Vector3f(13, 100, 0));
  ASSERT_EQ(map.model_trajectory.size(), 6U);
  EXPECT_EQ(map.model_trajectory[5].T_world_cam.translation(), Eigen::Vector3d(13, 100, 0));
  EXPECT_EQ(map.online_trajectory[10].T_world_cam.translation().y(), 100);
}

TEST(Pipeline, DoesNotAskForMoreObservationsThanThereAreMaps) {
  MapLog log;
  FakeSource source(3);  // one map fused of frame 1, one of frame 2
  PipelineOptions options;
  options.surfel_export.min_observations = 5;
  Pipeline pipeline(FakeStages(&log), {}, options);
  const Reconstruction result = pipeline.Run(source);
  EXPECT_EQ(log.min_observations, std::vector<int>{2});
}

TEST(Pipeline, EndsInOrderWhenToldToStop) {
  MapLog log;
  FakeSource source(16);
  std::atomic<bool> stop = false;
  PipelineObserver observer;
  observer.on_frame = [&](const PipelineProgress& progress) {
    if (progress.counts.num_frames == 6) stop = true;
  };
  const Reconstruction result = Pipeline(FakeStages(&log), observer).Run(source, &stop);
  EXPECT_EQ(result.counts.num_frames, 6);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].model.size(), 3U);  // frames 1 2 5: what was pending is finished
}

TEST(Pipeline, HandsEveryDepthMapToTheObserver) {
  MapLog log;
  FakeSource source(8);
  std::vector<std::int64_t> fused;
  std::vector<std::int64_t> rejected;
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult& fusion) {
    (fusion.status == FusionStatus::kFused ? fused : rejected).push_back(map.frame_index);
  };
  const Reconstruction result = Pipeline(FakeStages(&log), observer).Run(source);
  EXPECT_EQ(fused, (std::vector<std::int64_t>{1, 2, 5, 7}));
  EXPECT_EQ(rejected, std::vector<std::int64_t>{4});
}

// Models are made with the frame that completes their bundle, or two bundles behind.
class PipelineError : public testing::TestWithParam<bool> {
 protected:
  PipelineError() { options_.models_trail = GetParam(); }

  PipelineOptions options_;
  // Of the bundle of frame 5: with the next frame, or with the second bundle behind it, that of
  // frame 7.
  int failing_frame_ = GetParam() ? 8 : 6;
};

INSTANTIATE_TEST_SUITE_P(ModelsTrail, PipelineError, testing::Bool());

TEST_P(PipelineError, KeepsWhatThereWasBefore) {
  MapLog log;
  FakeSource source(10);
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
    if (map.frame_index >= 5) throw Error("no space left");
  };
  Pipeline pipeline(FakeStages(&log), observer, options_);
  for (int i = 0; i < failing_frame_; ++i) pipeline.Process(*source.Next());
  EXPECT_THROW(pipeline.Process(*source.Next()), Error);
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), static_cast<std::size_t>(failing_frame_) + 1);
  EXPECT_EQ(result.maps[0].model.size(), 3U);  // of frames 1, 2 and 5
}

// What the Error says that `step` throws.
template <typename Step>
std::string ErrorOf(const Step& step) {
  try {
    step();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST_P(PipelineError, SaysAtWhichFrameTheMemoryEndsAndKeepsWhatThereWas) {
  MapLog log;
  log.frame_without_memory = 5;
  FakeSource source(10);
  Pipeline pipeline(FakeStages(&log), {}, options_);
  for (int i = 0; i < failing_frame_; ++i) pipeline.Process(*source.Next());
  EXPECT_EQ(ErrorOf([&] { pipeline.Process(*source.Next()); }),
            "frame " + std::to_string(failing_frame_) + ": not enough memory on this machine");
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), static_cast<std::size_t>(failing_frame_) + 1);
  EXPECT_EQ(result.maps[0].model.size(), 2U);  // of frames 1 and 2
}

TEST(Pipeline, AModelThatCannotBeExportedDoesNotCostTheTrajectory) {
  MapLog log;
  log.has_memory_to_export = false;
  FakeSource source(8);
  Pipeline pipeline(FakeStages(&log));
  for (int i = 0; i < 8; ++i) pipeline.Process(*source.Next());
  EXPECT_EQ(ErrorOf([&] { static_cast<void>(pipeline.Finish()); }),
            "end of the run: not enough memory on this machine");
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 8U);
  EXPECT_TRUE(result.maps[0].model.empty());
  EXPECT_EQ(log.min_observations.size(), 1U) << "tried once";
}

TEST(Pipeline, AModelThatCannotBeMadeDoesNotCostTheTrajectory) {
  MapLog log;
  FakeSource source(8);
  PipelineStages stages = FakeStages(&log);
  stages.create_surfel_map = []() -> std::unique_ptr<SurfelMap> { throw Error("no memory"); };
  Pipeline pipeline(std::move(stages));
  std::size_t num_frames = 1;
  while (ErrorOf([&] { pipeline.Process(*source.Next()); }) == "none") ++num_frames;
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), num_frames);
  EXPECT_TRUE(result.maps[0].model.empty());
}

TEST(Pipeline, AModelThatCannotBeExportedIsAsItWasPublishedLast) {
  MapLog log;
  log.has_memory_to_export = false;
  FakeSource source(8);
  Pipeline pipeline(FakeStages(&log));
  (void)pipeline.Snapshot(0);  // somebody watches
  for (int i = 0; i < 8; ++i) pipeline.Process(*source.Next());
  EXPECT_THROW(static_cast<void>(pipeline.Finish()), Error);
  const Reconstruction result = pipeline.Finish();
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 8U);
  EXPECT_GE(result.maps[0].model.size(), 1U);
}

TEST(Pipeline, WithoutFramesThereIsNoMap) {
  MapLog log;
  FakeSource source(0);
  EXPECT_TRUE(Pipeline(FakeStages(&log)).Run(source).maps.empty());
}

TEST(PipelineOptions, ListsTheOptionsOfEveryModuleUnderItsName) {
  PipelineOptions options;
  bool has_keyframes = false;
  for (const OptionField& field : ListOptions(options)) {
    EXPECT_NE(field.name.find('.'), std::string::npos) << field.name;
    EXPECT_FALSE(field.help.empty()) << field.name;
    has_keyframes = has_keyframes || field.name == "keyframes.best_angle_deg";
  }
  EXPECT_TRUE(has_keyframes);
}

TEST(PipelineOptions, RefusesNoObservations) {
  PipelineOptions options;
  options.surfel_export.min_observations = 0;
  EXPECT_THROW(options.Validate(), UsageError);
}

}  // namespace
}  // namespace mono3d
