// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Footage of few images a second: from one to the next the image moves by a large share of itself.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kFewImagesHeight = 10;

// The next image of `sequence`, two a second.
void FewImages(const TexturedGround& ground, const Pose& T_world_cam, Sequence& sequence) {
  Frame frame;
  frame.index = static_cast<std::int64_t>(sequence.frames.size());
  frame.timestamp_s = 0.5 * static_cast<double>(frame.index);
  frame.name = "frame " + std::to_string(frame.index);
  frame.camera = SmallCamera();
  frame.bgr = ground.Render(frame.camera, T_world_cam);
  sequence.frames.push_back(std::move(frame));
  sequence.T_world_cam.push_back(T_world_cam);
}

// Looking steeply down, in a slight curve.
Sequence FlyFast(bool with_houses, const Eigen::Vector2d& step_px, int num_frames) {
  const TexturedGround ground(with_houses);
  Sequence sequence;
  for (int i = 0; i < num_frames; ++i) {
    const Eigen::Vector2d way = i * kFewImagesHeight / SmallCamera().fx * step_px;
    const Eigen::Vector3d eye(way.x(), way.y() + 0.4 * std::sin(1.3 * i), kFewImagesHeight);
    const Eigen::Vector3d target(way.x() + 0.3 * std::cos(0.8 * i), way.y() + 3, 0);
    FewImages(ground, LookAt(eye, target), sequence);
  }
  return sequence;
}

void ExpectTracked(const Sequence& sequence) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::string reasons;
  for (const Frame& frame : sequence.frames) {
    const TrackingResult result = tracker->Track(frame);
    EXPECT_EQ(result.reason.empty(), result.status == TrackingStatus::kTracking);
    reasons += std::to_string(frame.index) + ": " + result.reason + "\n";
  }
  const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
  ASSERT_EQ(trajectory.size(), sequence.frames.size()) << reasons;
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    EXPECT_EQ(entry.map_id, 0);
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(
        sequence.T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  // Of the height: a fifth of a pixel would be 0.06 %; small pictures of a texture sampled without
  // smoothing, and 20 degrees between the views, leave some times that.
  constexpr double kMaxRelativeError = 0.01;
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((fit * found[i] - truth[i]).norm() / kFewImagesHeight, kMaxRelativeError);
  }
}

TEST(FewImages, ThirtyPercentOfTheWidthFromOneToTheNext) {
  ExpectTracked(FlyFast(true, {0.3 * SmallCamera().width, 0}, 8));
}

TEST(FewImages, AThirdOfTheHeightFromOneToTheNext) {
  ExpectTracked(FlyFast(true, {0, SmallCamera().height / 3.0}, 8));
}

// The hardest footage to start from: nothing stands out of the ground, the flight is straight, and
// the third image shows a fifth of the first.
TEST(FewImages, FortyPercentOverExactlyFlatGroundStartsTheRightWayWithTheThirdImage) {
  const TexturedGround ground(false);
  const Pose attitude = LookAt({0, 0, kFewImagesHeight}, {0, 3, 0});
  for (const Eigen::Vector2d& direction : {Eigen::Vector2d(0, -1), Eigen::Vector2d(0.7, 0.7)}) {
    SCOPED_TRACE(direction.transpose());
    const double step = 0.4 * SmallCamera().height * kFewImagesHeight / SmallCamera().fx;
    const Eigen::Vector2d step_su = step * direction / std::abs(direction.y());
    Sequence sequence;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d eye(i * step_su.x(), i * step_su.y(), kFewImagesHeight);
      FewImages(ground, Pose(attitude.rotation(), eye), sequence);
    }
    const std::unique_ptr<Tracker> tracker = CreateTracker();
    std::string reason;
    for (const Frame& frame : sequence.frames) reason = tracker->Track(frame).reason;
    const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
    ASSERT_EQ(trajectory.size(), 3U) << reason;
    // The wrong motion turns by as much as the parallax of the first two, 15 degrees.
    constexpr double kMaxAngle_rad = 0.01;
    const Pose found = trajectory.front().T_world_cam.Inverse() * trajectory.back().T_world_cam;
    const Pose truth = sequence.T_world_cam.front().Inverse() * sequence.T_world_cam.back();
    EXPECT_LT(found.RotationAngle(), kMaxAngle_rad);
    EXPECT_GT(found.translation().normalized().dot(truth.translation().normalized()),
              std::cos(kMaxAngle_rad));
  }
}

}  // namespace
}  // namespace mono3d::tracking
