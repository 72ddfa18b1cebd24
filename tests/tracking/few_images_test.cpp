// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Footage of few images a second: from one to the next the image moves by a large share of itself.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kHeight = 10;

// Looking steeply down, two images a second, in a slight curve.
Sequence FlyFast(bool with_houses, const Eigen::Vector2d& step_px, int num_frames) {
  const TexturedGround ground(with_houses);
  const CameraModel camera = SmallCamera();
  Sequence sequence;
  for (int i = 0; i < num_frames; ++i) {
    const Eigen::Vector2d way = i * kHeight / camera.fx * step_px;
    const Eigen::Vector3d eye(way.x(), way.y() + 0.4 * std::sin(1.3 * i), kHeight);
    const Eigen::Vector3d target(way.x() + 0.3 * std::cos(0.8 * i), way.y() + 3, 0);
    sequence.T_world_cam.push_back(LookAt(eye, target));
    Frame frame;
    frame.index = i;
    frame.timestamp_s = 0.5 * i;
    frame.name = "frame " + std::to_string(i);
    frame.camera = camera;
    frame.bgr = ground.Render(camera, sequence.T_world_cam.back());
    sequence.frames.push_back(std::move(frame));
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
    EXPECT_LT((fit * found[i] - truth[i]).norm() / kHeight, kMaxRelativeError);
  }
}

TEST(FewImages, ThirtyPercentOfTheWidthFromOneToTheNext) {
  ExpectTracked(FlyFast(true, {0.3 * SmallCamera().width, 0}, 8));
}

TEST(FewImages, AThirdOfTheHeightFromOneToTheNext) {
  ExpectTracked(FlyFast(true, {0, SmallCamera().height / 3.0}, 8));
}

}  // namespace
}  // namespace mono3d::tracking
