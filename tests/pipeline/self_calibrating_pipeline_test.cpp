// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A live run that begins with a camera prior. Stages and calibration do as they are told: the
// trackers see the scene the smaller the longer their camera's focal length is, in a world of their
// own, so that it shows which of them a result comes from and whether its world goes on.

#include "mono3d/pipeline/self_calibrating_pipeline.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <numbers>
#include <thread>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "pipeline/gate.h"
#include "pipeline/keyframe_table.h"
#include "pipeline/live_stages.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kTrueFocal = 5;  // px

CameraModel CameraOf(double focal) {
  CameraModel camera = TinyCamera();
  camera.fx = camera.fy = focal;
  return camera;
}

// Where the camera really is: on a straight line, turning a little.
Pose TruePose(std::int64_t index) {
  const double turn = 0.01 * static_cast<double>(index);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())),
          {static_cast<double>(index), 0, 0}};
}

// The world of the tracker of that camera: the first one's is turned and scaled.
Similarity WorldOf(const CameraModel& camera) {
  if (camera.fx == kTrueFocal) return {};
  return {kTrueFocal / camera.fx,
          Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
               {3, 2, 1})};
}

struct WorldScript {
  std::function<void(const Frame&)> on_track = [](const Frame&) {};
  std::atomic<int> num_trackers = 0;
};

// Every frame is a final keyframe.
class WorldTracker final : public Tracker {
 public:
  explicit WorldTracker(WorldScript* script) : script_(script) { ++script->num_trackers; }
  TrackingResult Track(const Frame& frame) override {
    script_->on_track(frame);
    const Similarity world = WorldOf(frame.camera);
    const Pose T_world_cam = world * TruePose(frame.index);
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    result.T_world_cam = T_world_cam;
    result.pose = FramePose{frame.index, frame.timestamp_s, frame.index, Pose()};
    const std::lock_guard lock(mutex_);
    keyframes_.Set(frame.index, 0, Similarity(world.scale(), T_world_cam));
    result.finalised_keyframes = {{frame.index, frame, {1}}};
    return result;
  }
  KeyframePosesPtr Poses() const override {
    const std::lock_guard lock(mutex_);
    return keyframes_.Poses();
  }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  WorldScript* script_;
  mutable std::mutex mutex_;
  KeyframeTable keyframes_;
};

CapturedFrame Captured(std::int64_t index) {
  const Frame frame = NumberedFrame(index);
  return {index, frame.timestamp_s, frame.name, frame.bgr};
}

// The true camera, known well, or not at all.
CameraCalibration Found(const CameraPrior& prior, bool is_known) {
  CameraCalibration found;
  found.prior = found.posterior = prior;
  found.num_rounds = 1;
  found.uncertainty_px = is_known ? 0.001 : 10;
  if (!is_known) return found;
  found.posterior.camera = CameraOf(kTrueFocal);
  found.change_px = LargestDifference_px(prior.camera, found.posterior.camera);
  found.is_learned = found.determines_focal_length = found.change_px > 0;
  return found;
}

class SelfCalibrating : public testing::Test {
 protected:
  SelfCalibrating() {
    setup_.prior = DefaultCameraPrior(6, 4);
    setup_.prior.camera = CameraOf(2 * kTrueFocal);
    setup_.create_stages = [this] {
      PipelineStages stages;
      stages.tracker = std::make_unique<WorldTracker>(&script_);
      stages.keyframe_selector = std::make_unique<SingleSelector>();
      stages.depth_estimator = std::make_unique<ScriptedEstimator>(&depth_script_);
      stages.create_surfel_map = [] { return std::make_unique<CountingSurfelMap>(); };
      return stages;
    };
    setup_.calibrate = [](const CameraPrior& prior, const FootageOpener&) {
      return Found(prior, true);
    };
    options_.live = {.max_delay_s = 3600};  // whatever the machine does meanwhile
    calibration_.first_frames = 10;
  }

  void Begin() {
    pipeline_ = std::make_unique<SelfCalibratingPipeline>(setup_, options_, calibration_);
    pipeline_->Start();
  }
  void PushUpTo(std::int64_t end) {
    for (; next_ < end; ++next_) (void)pipeline_->Push(Captured(next_));
  }
  // Pushes frames until the second run is in use; fails after so many. At the pace of a fast
  // camera: the second run has to catch up, and what makes its model has a low priority.
  void PushUntilAdopted() {
    while (!is_adopted_ && next_ < 5000) {
      PushUpTo(next_ + 1);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_TRUE(is_adopted_);
  }

  WorldScript script_;
  LiveScript depth_script_;
  SelfCalibrationSetup setup_;
  PipelineOptions options_;
  SelfCalibrationOptions calibration_;
  std::int64_t next_ = 0;
  std::atomic<bool> is_adopted_ = false;
  std::unique_ptr<SelfCalibratingPipeline> pipeline_;  // ends first
};

// In the world of the first run, whose tracker has the camera there.
void ExpectFirstWorld(const std::vector<TrajectoryEntry>& entries, const CameraModel& first) {
  for (const TrajectoryEntry& entry : entries) {
    const Pose expected = WorldOf(first) * TruePose(entry.frame_index);
    EXPECT_LT((entry.T_world_cam.translation() - expected.translation()).norm(), 1e-6);
    EXPECT_LT(entry.T_world_cam.rotation().angularDistance(expected.rotation()), 1e-6);
  }
}

TEST_F(SelfCalibrating, AdoptsAProvenCameraWithEveryFrameInTheSameWorld) {
  setup_.on_adoption = [&](const SelfCalibration& state) {
    EXPECT_EQ(state.camera, CameraOf(kTrueFocal));
    is_adopted_ = true;
  };
  Begin();
  PushUntilAdopted();
  PushUpTo(next_ + 20);
  const Reconstruction result = pipeline_->Stop();
  ASSERT_TRUE(result.self_calibration);
  EXPECT_EQ(result.self_calibration->camera, CameraOf(kTrueFocal));
  EXPECT_EQ(result.self_calibration->num_attempts, 1);
  EXPECT_EQ(result.self_calibration->reason, "");
  ASSERT_TRUE(result.self_calibration->adopted_at_frame);
  EXPECT_GE(*result.self_calibration->adopted_at_frame, 10);
  EXPECT_LE(*result.self_calibration->adopted_at_frame, next_ - 20);
  ASSERT_EQ(result.maps.size(), 1U);
  const auto num_frames = static_cast<std::size_t>(next_);
  const CameraModel first = setup_.prior.camera;
  EXPECT_EQ(result.maps[0].trajectory.size(), num_frames);
  ExpectFirstWorld(result.maps[0].trajectory, first);
  EXPECT_EQ(result.maps[0].online_trajectory.size(), num_frames);
  ExpectFirstWorld(result.maps[0].online_trajectory, first);
  ExpectFirstWorld(result.maps[0].model_trajectory, first);
  EXPECT_FALSE(result.maps[0].model.empty());
  EXPECT_EQ(result.counts.num_frames, next_);
  EXPECT_EQ(script_.num_trackers, 2);
}

TEST_F(SelfCalibrating, ShowsTheOldModelUntilTheNewOneStandsAndNothingJumps) {
  Gate gate;  // holds the second run
  script_.on_track = [&](const Frame& frame) {
    if (frame.camera.fx == kTrueFocal && frame.index == 5) gate.Pass();
  };
  setup_.on_adoption = [&](const SelfCalibration&) { is_adopted_ = true; };
  std::atomic<int> num_shown = 0;
  setup_.create_observer = [&](const CameraModel& camera) {
    PipelineObserver observer;
    const bool is_second = camera.fx == kTrueFocal;
    observer.on_frame = [&, is_second, first = setup_.prior.camera](const PipelineProgress& now) {
      if (is_second) ++num_shown;
      const Pose expected = WorldOf(first) * TruePose(now.frame_index);
      EXPECT_LT((now.tracking.T_world_cam->translation() - expected.translation()).norm(), 1e-6);
    };
    return observer;
  };
  Begin();
  PushUpTo(10);
  gate.WaitForArrival();
  PushUpTo(next_ + 10);
  PipelineSnapshot before = pipeline_->Snapshot();
  while (before.surfels.anchors.empty() || before.frame_index + 1 < next_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    before = pipeline_->Snapshot();
  }
  EXPECT_EQ(num_shown, 0);
  gate.Open();
  PushUntilAdopted();
  PushUpTo(next_ + 10);
  PipelineSnapshot after = pipeline_->Snapshot(before.surfels.version);
  while (after.surfels.anchors.empty() || after.frame_index + 1 < next_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    after = pipeline_->Snapshot(before.surfels.version);
  }
  EXPECT_GT(num_shown, 0);
  ExpectFirstWorld({*before.pose, *after.pose}, setup_.prior.camera);
  EXPECT_GT(after.keyframe_poses->version(), before.keyframe_poses->version());
  EXPECT_GT(after.surfels.version, before.surfels.version);
  // The viewer gets every chunk of the new model, none of which is taken for an old one.
  EXPECT_EQ(after.surfels.changed.size(), after.surfels.anchors.size());
  for (const SurfelAnchor& old : before.surfels.anchors) {
    for (const SurfelAnchor& anchor : after.surfels.anchors) EXPECT_NE(anchor.number, old.number);
  }
  for (const SurfelAnchor& anchor : after.surfels.anchors) {
    const Similarity expected = WorldOf(setup_.prior.camera);
    EXPECT_NEAR(anchor.S_world_anchor.scale(), expected.scale(), 1e-6);
  }
  static_cast<void>(pipeline_->Stop());
}

TEST_F(SelfCalibrating, ChangesNothingWhereTheImagesAgree) {
  setup_.prior.camera = CameraOf(kTrueFocal);
  Begin();
  PushUpTo(100);
  const Reconstruction result = pipeline_->Stop();
  EXPECT_FALSE(result.self_calibration->adopted_at_frame);
  EXPECT_EQ(result.self_calibration->num_attempts, 1);
  EXPECT_EQ(result.self_calibration->reason, "the images agree with the camera");
  EXPECT_EQ(result.counts.num_frames, 100);
  EXPECT_EQ(script_.num_trackers, 1);
}

TEST_F(SelfCalibrating, TriesAgainWithMoreImagesAndAtLastWithAll) {
  std::vector<std::int64_t> num_frames;
  Gate gate;
  setup_.calibrate = [&](const CameraPrior& prior, const FootageOpener& open) {
    gate.Pass();
    num_frames.push_back(*open(prior.camera, 0, 0)->num_frames());
    return Found(prior, false);
  };
  Begin();
  PushUpTo(10);
  gate.WaitForArrival();
  gate.Open();
  PushUpTo(300);
  const Reconstruction result = pipeline_->Stop();
  ASSERT_GE(num_frames.size(), 2U);
  EXPECT_EQ(num_frames[0], 10);
  for (std::size_t i = 1; i < num_frames.size(); ++i) EXPECT_GT(num_frames[i], num_frames[i - 1]);
  EXPECT_EQ(num_frames.back(), 300);
  EXPECT_EQ(result.self_calibration->num_attempts, static_cast<int>(num_frames.size()));
  EXPECT_EQ(result.self_calibration->camera, setup_.prior.camera);
  EXPECT_THAT(result.self_calibration->reason, HasSubstr("do not tell"));
  EXPECT_EQ(script_.num_trackers, 1);
}

// Shorter than the first attempt waits for.
TEST_F(SelfCalibrating, StopAdoptsWhatAShortVideoTells) {
  calibration_.first_frames = 80;
  Begin();
  PushUpTo(30);
  const Reconstruction result = pipeline_->Stop();
  EXPECT_EQ(result.self_calibration->adopted_at_frame, 30);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 30U);
  EXPECT_EQ(result.self_calibration->camera, CameraOf(kTrueFocal));
}

TEST_F(SelfCalibrating, OfImagesThatAreNoLongerKeptNoCameraIsAdopted) {
  calibration_.max_buffer_mb = 72e-6 * 20;  // twenty images
  Gate gate;
  setup_.calibrate = [&](const CameraPrior& prior, const FootageOpener&) {
    gate.Pass();
    return Found(prior, true);
  };
  Begin();
  PushUpTo(10);
  gate.WaitForArrival();
  PushUpTo(40);
  gate.Open();
  const Reconstruction result = pipeline_->Stop();
  EXPECT_FALSE(result.self_calibration->adopted_at_frame);
  EXPECT_THAT(result.self_calibration->reason, HasSubstr("too late"));
  EXPECT_TRUE(result.self_calibration->calibration->is_learned);
  EXPECT_EQ(result.self_calibration->camera, setup_.prior.camera);
  EXPECT_EQ(result.maps[0].trajectory.size(), 40U);
}

TEST_F(SelfCalibrating, GoesOnWhereTheCalibrationFails) {
  setup_.calibrate = [](const CameraPrior&, const FootageOpener&) -> CameraCalibration {
    throw Error("no solution");
  };
  Begin();
  PushUpTo(50);
  const Reconstruction result = pipeline_->Stop();
  EXPECT_EQ(result.maps[0].trajectory.size(), 50U);
  EXPECT_FALSE(result.self_calibration->adopted_at_frame);
  EXPECT_EQ(result.self_calibration->reason, "no solution");
}

// Its depth maps go on too.
TEST_F(SelfCalibrating, GoesOnWhereTheSecondRunFails) {
  std::atomic<bool> has_failed = false;
  script_.on_track = [&](const Frame& frame) {
    if (frame.camera.fx != kTrueFocal || frame.index != 7) return;
    has_failed = true;
    throw Error("out of memory");
  };
  Begin();
  PushUpTo(20);
  while (!has_failed) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  PushUpTo(50);
  const Reconstruction result = pipeline_->Stop();
  EXPECT_EQ(result.maps[0].trajectory.size(), 50U);
  EXPECT_FALSE(result.maps[0].model.empty());
  EXPECT_EQ(result.self_calibration->camera, setup_.prior.camera);
  EXPECT_THAT(result.self_calibration->reason, HasSubstr("out of memory"));
}

TEST_F(SelfCalibrating, HandsOnWhatTheRunInUseThrows) {
  script_.on_track = [](const Frame& frame) {
    if (frame.index == 3) throw Error("no space left");
  };
  Begin();
  // Tracked in another thread: which push hands the error on is a matter of chance.
  EXPECT_THAT([&] { PushUpTo(5000); }, ThrowsMessage<Error>(HasSubstr("no space left")));
  const Reconstruction result = pipeline_->Stop();
  EXPECT_EQ(result.maps[0].trajectory.size(), 3U);
  EXPECT_FALSE(result.self_calibration->adopted_at_frame);
}

TEST_F(SelfCalibrating, EndsDuringTheCalibrationAndDuringTheSecondRun) {
  std::atomic<bool> is_reading = false;
  setup_.calibrate = [&](const CameraPrior& prior, const FootageOpener& open) {
    is_reading = true;
    // As a calibration that takes for ever; it ends as nothing can be read any more.
    while (true) (void)open(prior.camera, 0, 0)->Next();
    return Found(prior, true);
  };
  Begin();
  PushUpTo(20);
  while (!is_reading) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  pipeline_.reset();

  next_ = 0;
  setup_.calibrate = [](const CameraPrior& prior, const FootageOpener&) {
    return Found(prior, true);
  };
  Gate gate;
  script_.on_track = [&](const Frame& frame) {
    if (frame.camera.fx == kTrueFocal) gate.Pass();
  };
  Begin();
  PushUpTo(20);
  gate.WaitForArrival();
  std::thread opener([&] { gate.Open(); });
  pipeline_.reset();
  opener.join();
}

TEST_F(SelfCalibrating, RefusesFramesThatCannotBe) {
  pipeline_ = std::make_unique<SelfCalibratingPipeline>(setup_, options_, calibration_);
  EXPECT_THROW((void)pipeline_->Push(Captured(0)), Error);
  pipeline_->Start();
  EXPECT_THROW(pipeline_->Start(), Error);
  PushUpTo(2);
  EXPECT_THROW((void)pipeline_->Push(Captured(1)), Error);
  CapturedFrame other = Captured(2);
  other.bgr = cv::Mat(5, 6, CV_8UC3);
  EXPECT_THROW((void)pipeline_->Push(other), Error);
  static_cast<void>(pipeline_->Stop());
  EXPECT_THROW((void)pipeline_->Push(Captured(2)), Error);
  calibration_.max_buffer_mb = 0;
  EXPECT_THROW(SelfCalibratingPipeline(setup_, options_, calibration_), UsageError);
}

// The real tracker and the real calibration, on a part of an orbit over houses.
TEST(SelfCalibratingPipeline, LearnsAFocalLengthThatIsAFifthTooLong) {
  const CameraModel truth = tracking::SmallCamera();
  const tracking::TexturedGround ground(true);
  SelfCalibrationSetup setup;
  setup.prior = DefaultCameraPrior(truth.width, truth.height);
  setup.prior.camera.fx = setup.prior.camera.fy = 1.2 * truth.fx;
  const LiveScript script;
  setup.create_stages = [&] {
    PipelineStages stages;
    TrackerOptions tracking;
    tracking.mode = "live";  // as CreateStages has it
    stages.tracker = CreateTracker(tracking);
    stages.keyframe_selector = CreateKeyframeSelector({});
    stages.depth_estimator = std::make_unique<ScriptedEstimator>(&script);
    stages.create_surfel_map = [] { return std::make_unique<CountingSurfelMap>(); };
    return stages;
  };
  PipelineOptions options;
  options.live = {.max_delay_s = 3600};
  SelfCalibrationOptions calibration;
  calibration.calibration.max_rounds = 2;
  SelfCalibratingPipeline pipeline(setup, options, calibration);
  pipeline.Start();
  std::vector<Eigen::Vector3d> true_eyes;
  for (int i = 0; i < 45; ++i) {
    const double angle = 0.025 * i;
    const Pose T_world_cam =
        tracking::LookAt({10 * std::sin(angle), -10 * std::cos(angle), 10},
                         {0.8 * std::sin(0.2 * i), 0.8 * std::cos(0.13 * i), 0});
    true_eyes.push_back(T_world_cam.translation());
    (void)pipeline.Push(
        {i, 0.1 * i, "frame " + std::to_string(i), ground.Render(truth, T_world_cam)});
  }
  const Reconstruction result = pipeline.Stop();
  ASSERT_TRUE(result.self_calibration->adopted_at_frame) << result.self_calibration->reason;
  EXPECT_NEAR(result.self_calibration->camera.fx, truth.fx, 0.01 * truth.fx);
  ASSERT_EQ(result.maps.size(), 1U);
  const std::vector<TrajectoryEntry>& trajectory = result.maps[0].trajectory;
  ASSERT_GE(trajectory.size(), 43U);
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> expected;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    expected.push_back(true_eyes[static_cast<std::size_t>(entry.frame_index)]);
  }
  const Similarity fit = FitSimilarity(found, expected);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    sum += (fit * found[i] - expected[i]).squaredNorm();
  // Of the distance of 14 to what is looked at; with the prior's focal length it is 1 % or more.
  EXPECT_LT(std::sqrt(sum / static_cast<double>(found.size())) / 14, 0.003);
}

}  // namespace
}  // namespace mono3d
