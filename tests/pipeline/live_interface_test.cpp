// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Start, Push, Snapshot and Stop, over stages that do as they are told.

#include <gmock/gmock.h>

#include <atomic>
#include <memory>
#include <numbers>
#include <thread>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/gate.h"
#include "pipeline/live_stages.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class LiveInterface : public testing::Test {
 protected:
  PipelineStages Stages() {
    PipelineStages stages;
    stages.tracker = std::make_unique<KeepingTracker>(&script_);
    stages.keyframe_selector = std::make_unique<SingleSelector>();
    stages.depth_estimator = std::make_unique<ScriptedEstimator>(&script_);
    stages.create_surfel_map = [] { return std::make_unique<CountingSurfelMap>(); };
    return stages;
  }

  std::unique_ptr<Pipeline> Live() {
    PipelineOptions options;
    options.is_live = true;
    options.live = live_;
    return std::make_unique<Pipeline>(Stages(), observer_, options);
  }

  LiveScript script_;
  PipelineObserver observer_;
  LiveOptions live_ = {.max_delay_s = 3600};  // whatever the machine does meanwhile
};

TEST_F(LiveInterface, TracksEveryPushedFrameAndHandsOverTheModel) {
  const auto pipeline = Live();
  pipeline->Start();
  for (int i = 0; i < 10; ++i) EXPECT_THAT(pipeline->Push(NumberedFrame(i)).dropped, IsEmpty());
  const Reconstruction result = pipeline->Stop();
  EXPECT_EQ(result.counts.num_frames, 10);
  EXPECT_EQ(result.counts.num_dropped_frames, 0);
  EXPECT_EQ(result.counts.num_keyframes, 10);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].trajectory.size(), 10U);
  EXPECT_EQ(result.maps[0].model.size(),
            static_cast<std::size_t>(10 - result.counts.num_dropped_bundles));
  ASSERT_TRUE(result.live);
  EXPECT_GE(result.live->max_latency_ms, result.live->mean_latency_ms);
}

// As cv::VideoCapture fills it: one image, written over and over again.
TEST_F(LiveInterface, OwnsThePixelsThatItKeeps) {
  std::vector<std::pair<std::int64_t, int>> seen;  // index and value of keyframes in bundles
  script_.on_estimate = [&](const ImageBundle& bundle) {
    const Frame& frame = bundle.reference().frame;
    seen.emplace_back(frame.index, frame.bgr.at<cv::Vec3b>(3, 5)[2]);
  };
  const auto expect_own = [&](std::size_t min_seen) {
    EXPECT_GE(seen.size(), min_seen);
    for (const auto& [index, value] : seen) EXPECT_EQ(value, index);
    seen.clear();
  };
  cv::Mat reused(4, 6, CV_8UC3);
  const auto next_frame = [&](std::int64_t index) {
    Frame frame = NumberedFrame(index);
    reused.setTo(cv::Scalar::all(static_cast<double>(index)));
    frame.bgr = reused;
    return frame;
  };
  {
    const auto pipeline = Live();
    pipeline->Start();
    for (int i = 0; i < 20; ++i) (void)pipeline->Push(next_frame(i));
    reused.setTo(255);
    static_cast<void>(pipeline->Stop());
    expect_own(2);
  }
  {
    Pipeline sequential(Stages());
    for (int i = 0; i < 20; ++i) sequential.Process(next_frame(i));
    reused.setTo(255);
    static_cast<void>(sequential.Finish());
    expect_own(20);
  }
  {
    // One Frame whose image is the only one that holds its pixels, filled again and again.
    Pipeline sequential(Stages());
    Frame frame = NumberedFrame(0);
    for (int i = 0; i < 20; ++i) {
      frame.index = i;
      frame.bgr.setTo(cv::Scalar::all(i));
      sequential.Process(frame);
    }
    static_cast<void>(sequential.Finish());
    expect_own(20);
  }
}

TEST_F(LiveInterface, DoesNotCopyAnImageThatIsHandedOver) {
  const uchar* tracked = nullptr;
  script_.on_track = [&](const Frame& frame) { tracked = frame.bgr.data; };
  const auto pipeline = Live();
  pipeline->Start();
  Frame frame = NumberedFrame(0);
  const uchar* pushed = frame.bgr.data;
  (void)pipeline->Push(std::move(frame));
  static_cast<void>(pipeline->Stop());
  EXPECT_EQ(tracked, pushed);
}

// Frame 0 is being tracked while 1 to 4 come, of which two have room.
TEST_F(LiveInterface, DropsTheOldestFramesThatWaitAndSaysSo) {
  Gate gate;
  script_.on_track = [&](const Frame& frame) {
    if (frame.index == 0) gate.Pass();
  };
  constexpr double kImage_mb = 4 * 6 * 3 / 1e6;
  live_.max_waiting_mb = 2.5 * kImage_mb;
  const auto pipeline = Live();
  pipeline->Start();
  EXPECT_EQ(pipeline->Push(NumberedFrame(0)).num_waiting, 1);
  gate.WaitForArrival();
  EXPECT_EQ(pipeline->Push(NumberedFrame(1)).num_waiting, 1);
  EXPECT_EQ(pipeline->Push(NumberedFrame(2)).num_waiting, 2);
  EXPECT_THAT(pipeline->Push(NumberedFrame(3)).dropped, ElementsAre(1));
  const PushResult last = pipeline->Push(NumberedFrame(4));
  EXPECT_THAT(last.dropped, ElementsAre(2));
  EXPECT_EQ(last.num_waiting, 2);
  EXPECT_EQ(pipeline->Snapshot().counts.num_dropped_frames, 2);
  gate.Open();
  const Reconstruction result = pipeline->Stop();
  EXPECT_EQ(result.counts.num_frames, 3);
  EXPECT_EQ(result.counts.num_dropped_frames, 2);
  EXPECT_EQ(result.maps.at(0).trajectory.back().frame_index, 4);
}

// The depth stage is busy with frame 0 all the time.
TEST_F(LiveInterface, ASnapshotWaitsForNothing) {
  Gate gate;
  script_.on_estimate = [&](const ImageBundle&) { gate.Pass(); };
  const auto pipeline = Live();
  EXPECT_EQ(pipeline->Snapshot().frame_index, -1);
  ASSERT_NE(pipeline->Snapshot().keyframe_poses, nullptr);
  pipeline->Start();
  for (int i = 0; i < 3; ++i) (void)pipeline->Push(NumberedFrame(i));
  gate.WaitForArrival();
  PipelineSnapshot now = pipeline->Snapshot();
  while (now.frame_index < 2) now = pipeline->Snapshot();
  EXPECT_EQ(now.status, TrackingStatus::kTracking);
  EXPECT_EQ(now.counts.num_frames, 3);
  EXPECT_EQ(now.counts.num_depth_maps, 0);
  EXPECT_EQ(now.surfels.version, 0U);
  EXPECT_TRUE(now.surfels.changed.empty());
  EXPECT_EQ(now.model_poses, nullptr);
  ASSERT_TRUE(now.pose);
  EXPECT_EQ(now.pose->T_world_cam.translation().x(), 2);
  EXPECT_EQ(now.keyframe_poses->poses().size(), 3U);
  gate.Open();
  static_cast<void>(pipeline->Stop());
}

TEST_F(LiveInterface, PublishesSurfelsOnceSomebodyAsks) {
  const auto pipeline = Live();
  pipeline->Start();
  (void)pipeline->Push(NumberedFrame(0));
  (void)pipeline->Push(NumberedFrame(1));  // makes keyframe 0 final
  PipelineSnapshot now = pipeline->Snapshot();
  while (now.surfels.changed.empty()) now = pipeline->Snapshot(now.surfels.version);
  EXPECT_GE(now.surfels.version, 1U);
  ASSERT_NE(now.model_poses, nullptr);
  EXPECT_NE(now.model_poses->Find(0), nullptr);
  const PipelineSnapshot same = pipeline->Snapshot(now.surfels.version);
  EXPECT_EQ(same.surfels.version, now.surfels.version);
  EXPECT_TRUE(same.surfels.changed.empty());
  EXPECT_EQ(same.surfels.anchors.size(), 1U);
  EXPECT_EQ(pipeline->Snapshot().surfels.changed.size(), 1U) << "all of them";
  (void)pipeline->Push(NumberedFrame(2));
  PipelineSnapshot next = pipeline->Snapshot(now.surfels.version);
  while (next.surfels.changed.empty()) next = pipeline->Snapshot(now.surfels.version);
  ASSERT_EQ(next.surfels.changed.size(), 1U) << "only what is new";
  EXPECT_EQ(next.surfels.changed[0].anchor, 1U);
  EXPECT_EQ(next.surfels.anchors.size(), 2U);
  const PointCloud model = ToPointCloud(pipeline->Snapshot().surfels);
  ASSERT_EQ(model.size(), 2U);
  EXPECT_EQ(model.points[1], Eigen::Vector3f(1, 0, 2));
  static_cast<void>(pipeline->Stop());
}

TEST(ToPointCloud, PutsSurfelsIntoTheWorldWithoutThoseOfLittleConfidence) {
  PointCloud own;
  own.points = {{1, 0, 0}, {9, 9, 9}};
  own.normals = {{1, 0, 0}, {0, 0, 1}};
  own.colours = {{1, 2, 3}, {4, 5, 6}};
  own.radii = {0.5F, 0.5F};
  own.confidences = {0.5F, 0.1F};
  own.observations = {3, 1};
  SurfelChanges surfels;
  const Similarity S_world_anchor(
      2, Pose(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(10, 0, 0)));
  surfels.anchors = {{4, 0, 0, S_world_anchor}};
  surfels.changed = {{4, std::make_shared<PointCloud>(own)}};
  const PointCloud cloud = ToPointCloud(surfels);
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_LT((cloud.points[0] - Eigen::Vector3f(10, 2, 0)).norm(), 1e-5F);
  EXPECT_LT((cloud.normals[0] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6F);
  EXPECT_EQ(cloud.radii[0], 1);
  EXPECT_EQ(cloud.colours[0], own.colours[0]);
  EXPECT_EQ(cloud.observations[0], 3);
  EXPECT_EQ(ToPointCloud(surfels, {.min_confidence = 0}).size(), 2U);
  // Where hardly anything is sure, the surest.
  own.confidences = {0.05F, 0.01F};
  surfels.changed = {{4, std::make_shared<PointCloud>(own)}};
  EXPECT_EQ(ToPointCloud(surfels).size(), 1U);
  EXPECT_TRUE(ToPointCloud(surfels, {.min_share = 0}).empty());
  // Of all of them or of none.
  EXPECT_TRUE(cloud.first_frames.empty());
  own.first_frames = {12, 13};
  surfels.changed.push_back({4, std::make_shared<PointCloud>(own)});
  EXPECT_TRUE(ToPointCloud(surfels).first_frames.empty());
  surfels.changed.erase(surfels.changed.begin());
  EXPECT_EQ(ToPointCloud(surfels).first_frames, std::vector<std::uint32_t>{12});
}

TEST_F(LiveInterface, SnapshotsComeFromAnyThreadWhileFramesArePushed) {
  const auto pipeline = Live();
  pipeline->Start();
  std::atomic<bool> is_over = false;
  std::int64_t latest = -1;
  std::thread viewer([&] {
    std::uint64_t version = 0;
    while (!is_over) {
      const PipelineSnapshot now = pipeline->Snapshot(version);
      EXPECT_GE(now.frame_index, latest);
      EXPECT_GE(now.surfels.version, version);
      if (now.pose) {
        EXPECT_EQ(now.pose->frame_index, now.frame_index);
      }
      latest = now.frame_index;
      version = now.surfels.version;
    }
  });
  for (int i = 0; i < 200; ++i) (void)pipeline->Push(NumberedFrame(i));
  const Reconstruction result = pipeline->Stop();
  is_over = true;
  viewer.join();
  EXPECT_EQ(result.counts.num_frames, 200);
  EXPECT_EQ(pipeline->Snapshot().counts.num_frames, 200);
}

// What `step` throws, or "nothing".
template <typename Step>
std::string InterfaceErrorOf(const Step& step) {
  try {
    step();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

TEST_F(LiveInterface, WhatTrackingThrowsComesOutOfPushAndLeavesWhatThereWas) {
  Gate gate;
  script_.on_track = [&](const Frame& frame) {
    if (frame.index < 3) return;
    gate.Pass();
    throw Error("out of order");
  };
  const auto pipeline = Live();
  pipeline->Start();
  for (int i = 0; i < 5; ++i) (void)pipeline->Push(NumberedFrame(i));
  gate.WaitForArrival();
  gate.Open();
  std::string error = "nothing";
  for (int i = 5; error == "nothing"; ++i) {
    error = InterfaceErrorOf([&] { (void)pipeline->Push(NumberedFrame(i)); });
  }
  EXPECT_EQ(error, "out of order");
  EXPECT_EQ(InterfaceErrorOf([&] { (void)pipeline->Push(NumberedFrame(100000)); }), "out of order");
  EXPECT_EQ(InterfaceErrorOf([&] { (void)pipeline->Snapshot(); }), "nothing") << "it is known";
  const Reconstruction result = pipeline->Stop();
  EXPECT_EQ(result.counts.num_frames, 4);
  EXPECT_EQ(result.maps.at(0).trajectory.size(), 3U);
}

TEST_F(LiveInterface, WhatTheModelThrowsComesOutOfASnapshotWithoutAnotherFrame) {
  script_.on_estimate = [](const ImageBundle& bundle) {
    if (bundle.reference().id == 1) throw Error("device lost");
  };
  const auto pipeline = Live();
  pipeline->Start();
  (void)pipeline->Push(NumberedFrame(0));
  (void)pipeline->Push(NumberedFrame(1));
  while (pipeline->Snapshot().counts.num_fused < 1) {
  }
  (void)pipeline->Push(NumberedFrame(2));
  std::string error = "nothing";
  while (error == "nothing") error = InterfaceErrorOf([&] { (void)pipeline->Snapshot(); });
  EXPECT_EQ(error, "device lost");
  EXPECT_EQ(InterfaceErrorOf([&] { (void)pipeline->Push(NumberedFrame(3)); }), "device lost");
  const Reconstruction result = pipeline->Stop();
  EXPECT_EQ(result.maps.at(0).trajectory.size(), 3U);
  EXPECT_EQ(result.maps.at(0).model.size(), 1U);
}

TEST_F(LiveInterface, AnErrorThatNobodyHasSeenComesOutOfStopOnce) {
  script_.on_estimate = [](const ImageBundle&) { throw Error("device lost"); };
  const auto pipeline = Live();
  pipeline->Start();
  (void)pipeline->Push(NumberedFrame(0));
  EXPECT_EQ(InterfaceErrorOf([&] { static_cast<void>(pipeline->Stop()); }), "device lost");
  EXPECT_EQ(pipeline->Stop().maps.at(0).trajectory.size(), 1U);
}

TEST_F(LiveInterface, RefusesAFrameThatDoesNotFitAndGoesOn) {
  const auto pipeline = Live();
  pipeline->Start();
  (void)pipeline->Push(NumberedFrame(3));
  Frame small = NumberedFrame(4);
  small.bgr = small.bgr(cv::Rect(0, 0, 3, 2));
  EXPECT_THAT([&] { (void)pipeline->Push(small); }, ThrowsMessage<Error>(HasSubstr("frame4")));
  Frame zoomed = NumberedFrame(4);
  zoomed.camera.fx *= 2;
  EXPECT_THAT([&] { (void)pipeline->Push(zoomed); }, ThrowsMessage<Error>(HasSubstr("camera")));
  EXPECT_THAT([&] { (void)pipeline->Push(NumberedFrame(3)); },
              ThrowsMessage<Error>(HasSubstr("order of time")));
  (void)pipeline->Push(NumberedFrame(4));
  EXPECT_EQ(pipeline->Stop().counts.num_frames, 2);
}

TEST_F(LiveInterface, CallsInTheWrongOrderAreErrors) {
  const auto pipeline = Live();
  EXPECT_THROW((void)pipeline->Push(NumberedFrame(0)), Error);
  pipeline->Start();
  EXPECT_THROW(pipeline->Start(), Error);
  EXPECT_THROW(pipeline->Process(NumberedFrame(0)), Error);
  (void)pipeline->Push(NumberedFrame(0));
  EXPECT_EQ(pipeline->Stop().counts.num_frames, 1);
  EXPECT_THROW((void)pipeline->Push(NumberedFrame(1)), Error);

  const auto sequential = Live();
  sequential->Process(NumberedFrame(0));
  EXPECT_THROW(sequential->Start(), Error);
}

TEST_F(LiveInterface, StopWithoutStartOrFramesIsAnEmptyReconstruction) {
  EXPECT_THAT(Live()->Stop().maps, IsEmpty());
  const auto pipeline = Live();
  pipeline->Start();
  EXPECT_THAT(pipeline->Stop().maps, IsEmpty());
}

TEST_F(LiveInterface, IsDestroyedInTheMiddleOfItsWork) {
  Gate gate;
  script_.on_track = [&](const Frame& frame) {
    if (frame.index == 2) gate.Pass();
  };
  auto pipeline = Live();
  pipeline->Start();
  for (int i = 0; i < 50; ++i) (void)pipeline->Push(NumberedFrame(i));
  gate.WaitForArrival();
  gate.Open();
  pipeline.reset();
}

TEST_F(LiveInterface, ASequentialPipelineIsPushedToAsWell) {
  Pipeline pipeline(Stages());  // models are made by the thread that tracks
  pipeline.Start();
  for (int i = 0; i < 4; ++i) (void)pipeline.Push(NumberedFrame(i));
  EXPECT_EQ(pipeline.Stop().counts.num_fused, pipeline.Stop().counts.num_fused);
}

}  // namespace
}  // namespace mono3d
