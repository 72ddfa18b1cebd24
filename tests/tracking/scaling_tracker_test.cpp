// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/scaling_tracker.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::Each;
using testing::IsEmpty;
using testing::Lt;
using testing::Not;

constexpr int kNumScaledFrames = 20;
constexpr int kEnlarged = 2;

// A flight whose images were enlarged: there is nothing in them that the small ones do not have.
const Sequence& LargeVillage() {
  static const Sequence sequence = [] {
    Sequence flight = FlyOver(TexturedGround(true), kNumScaledFrames);
    for (Frame& frame : flight.frames) {
      frame.camera =
          frame.camera.Resized(kEnlarged * frame.camera.width, kEnlarged * frame.camera.height);
      cv::Mat large;
      cv::resize(frame.bgr, large, cv::Size(frame.camera.width, frame.camera.height), 0, 0,
                 cv::INTER_CUBIC);
      frame.bgr = large;
    }
    return flight;
  }();
  return sequence;
}

TrackerOptions ForSmallImages() {
  TrackerOptions options;
  options.max_side_px = SmallCamera().width;
  return options;
}

TEST(ScalingTracker, LargeImagesGetTheirPosesAndKeyframesThemselves) {
  const Sequence& flight = LargeVillage();
  const std::unique_ptr<Tracker> tracker = CreateTracker(ForSmallImages());
  std::vector<Keyframe> keyframes;
  for (const Frame& frame : flight.frames) {
    for (Keyframe& keyframe : tracker->Track(frame).finalised_keyframes) {
      keyframes.push_back(std::move(keyframe));
    }
  }
  for (Keyframe& keyframe : tracker->Finish()) keyframes.push_back(std::move(keyframe));

  const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
  ASSERT_EQ(trajectory.size(), flight.frames.size());
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(flight.T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  // As for the small images themselves: half a percent of the flying height of 10.
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_LT((fit * found[i] - truth[i]).norm(), .05);

  EXPECT_EQ(keyframes.size(), tracker->KeyframeTrajectory().size());
  ASSERT_GE(keyframes.size(), 3U);
  for (const Keyframe& keyframe : keyframes) {
    const Frame& given = flight.frames[static_cast<std::size_t>(keyframe.frame.index)];
    EXPECT_EQ(keyframe.frame.camera, given.camera);
    EXPECT_EQ(cv::norm(keyframe.frame.bgr, given.bgr, cv::NORM_INF), 0);
  }
}

TEST(ScalingTracker, SparsePointsAreInPixelsOfTheImagesGiven) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(ForSmallImages());
  double reprojection_px = 0;
  for (const Frame& frame : LargeVillage().frames) {
    reprojection_px = tracker->Track(frame).reprojection_px;
  }
  const SparseModel sparse = tracker->Sparse(0);
  EXPECT_EQ(sparse.camera, LargeVillage().frames.front().camera);
  EXPECT_GT(reprojection_px, 0);
  // Outliers beyond 2.5 pixels of the small image, of an octave of up to 1.2^7 are no observations.
  const std::vector<double> errors_px = ReprojectionErrors_px(sparse);
  EXPECT_THAT(errors_px, Not(IsEmpty()));
  EXPECT_THAT(errors_px, Each(Lt(2.5 * 3.6 * kEnlarged)));
  std::vector<float> sorted(errors_px.begin(), errors_px.end());
  EXPECT_LT(UpperMedian(sorted), 0.5 * kEnlarged);
}

TEST(ScalingTracker, SmallImagesPassAsTheyAre) {
  const Sequence flight = FlyOver(TexturedGround(true), 8);
  const std::unique_ptr<Tracker> scaling = CreateTracker(ForSmallImages());
  TrackerOptions never_scaled;
  never_scaled.max_side_px = 100'000;
  const std::unique_ptr<Tracker> plain = CreateTracker(never_scaled);
  for (const Frame& frame : flight.frames) {
    const TrackingResult a = scaling->Track(frame);
    const TrackingResult b = plain->Track(frame);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.num_inliers, b.num_inliers);
    EXPECT_EQ(a.reprojection_px, b.reprojection_px);
  }
}

TEST(ScalingTracker, CountsAndTellsOfKeyframesWhoseImageHasGone) {
  int num_warnings = 0;
  SetLogSink([&](LogLevel level, std::string_view message) {
    const bool is_meant = message.find("no longer kept") != std::string_view::npos;
    num_warnings += level == LogLevel::kWarning && is_meant ? 1 : 0;
  });
  ScalingTracker tracker(CreateTracker(), SmallCamera().width, 0);
  std::size_t num_handed_out = 0;
  for (const Frame& frame : LargeVillage().frames) {
    num_handed_out += tracker.Track(frame).finalised_keyframes.size();
  }
  num_handed_out += tracker.Finish().size();
  SetLogSink({});
  EXPECT_EQ(num_handed_out, 0U);
  EXPECT_EQ(tracker.num_keyframes_without_image(),
            static_cast<std::int64_t>(tracker.KeyframeTrajectory().size()));
  EXPECT_GE(tracker.num_keyframes_without_image(), 3);
  EXPECT_EQ(num_warnings, 1);
}

TEST(ScalingTracker, RefusesACameraThatChanges) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(ForSmallImages());
  Frame frame = LargeVillage().frames[0];
  static_cast<void>(tracker->Track(frame));
  frame.index = 1;
  frame.timestamp_s += 0.1;
  frame.camera.fx *= 1.1;
  EXPECT_THROW(static_cast<void>(tracker->Track(frame)), Error);
}

TEST(KeptImages, OldestGoFirstWhenThereAreTooManyBytes) {
  const auto image = [](int number) { return cv::Mat(10, 10, CV_8UC3, cv::Scalar::all(number)); };
  KeptImages kept(900);  // three of them
  for (int i = 0; i < 5; ++i) kept.Add(i, image(i));
  EXPECT_EQ(kept.size(), 3U);
  EXPECT_FALSE(kept.Take(1).has_value());
  const std::optional<cv::Mat> third = kept.Take(3);
  ASSERT_TRUE(third.has_value());
  EXPECT_EQ(third->at<cv::Vec3b>(0, 0)[0], 3);
  EXPECT_FALSE(kept.Take(3).has_value());
  kept.Remove(2);
  EXPECT_EQ(kept.size(), 1U);
  kept.Add(4, image(9));  // in place of the other
  EXPECT_EQ(kept.size(), 1U);
}

}  // namespace
}  // namespace mono3d::tracking
