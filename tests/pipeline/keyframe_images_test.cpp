// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "mono3d/pipeline/pipeline.h"
#include "pipeline/keyframe_table.h"

namespace mono3d {
namespace {

// A bright column in each image.
constexpr int kColumn = 30;
cv::Mat ColumnImage() {
  cv::Mat bgr(40, 60, CV_8UC3, cv::Scalar(0, 0, 0));
  bgr.col(kColumn) = cv::Scalar(255, 255, 255);
  return bgr;
}

// Every frame is a keyframe of a camera that turns: what its first line shows is 2.5 px left of
// where it was when the middle line was read.
class TurningTracker final : public Tracker {
 public:
  explicit TurningTracker(std::vector<Keyframe>* handed_over) : handed_over_(handed_over) {}

  TrackingResult Track(const Frame& frame) override {
    Keyframe keyframe;
    keyframe.id = frame.index;
    keyframe.frame = frame;
    keyframe.velocity.angular_rad_per_s = {0, 1, 0};
    keyframes_.Set(keyframe.id, 0, Pose());
    handed_over_->push_back(keyframe);
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    result.T_world_cam = Pose();
    result.finalised_keyframes = {keyframe};
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override { return keyframes_.Entries(0.1); }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  std::vector<Keyframe>* handed_over_;
  KeyframeTable keyframes_;
};

// Tells what it was given, and selects nothing.
class RecordingSelector final : public KeyframeSelector {
 public:
  explicit RecordingSelector(std::vector<Keyframe>* given) : given_(given) {}
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    given_->push_back(keyframe);
    return std::nullopt;
  }

 private:
  std::vector<Keyframe>* given_;
};

TEST(KeyframeImages, AreOfAGlobalShutterBehindTheTracker) {
  std::vector<Keyframe> tracked;
  std::vector<Keyframe> selected;
  std::vector<Keyframe> observed;
  PipelineStages stages;
  stages.tracker = std::make_unique<TurningTracker>(&tracked);
  stages.keyframe_selector = std::make_unique<RecordingSelector>(&selected);
  PipelineObserver observer;
  observer.on_keyframe = [&](const Keyframe& keyframe) { observed.push_back(keyframe); };
  Pipeline pipeline(std::move(stages), observer);
  for (int i = 0; i < 2; ++i) {
    Frame frame;
    frame.index = i;
    frame.bgr = ColumnImage();
    frame.camera = {.width = 60, .height = 40, .fx = 50, .fy = 50, .cx = 29.5, .cy = 19.5};
    frame.sensor = frame.camera;
    frame.sensor.shutter.readout_s = 0.1;
    pipeline.Process(frame);
  }
  ASSERT_EQ(tracked.size(), 2U);
  ASSERT_EQ(selected.size(), 2U);
  ASSERT_EQ(observed.size(), 2U);
  const auto brightness = [](const Keyframe& keyframe, int x) {
    return keyframe.frame.bgr.at<cv::Vec3b>(0, x)[0];
  };
  for (std::size_t i = 0; i < selected.size(); ++i) {
    EXPECT_EQ(selected[i].id, tracked[i].id);
    EXPECT_EQ(selected[i].frame.sensor, CameraModel());
    EXPECT_LT(brightness(selected[i], kColumn), 50);
    EXPECT_GT(brightness(selected[i], kColumn + 2) + brightness(selected[i], kColumn + 3), 200);
    EXPECT_EQ(observed[i].frame.bgr.data, selected[i].frame.bgr.data);
    // The tracker goes on with the image as it was taken.
    EXPECT_EQ(cv::norm(tracked[i].frame.bgr, ColumnImage(), cv::NORM_INF), 0);
  }
}

}  // namespace
}  // namespace mono3d
