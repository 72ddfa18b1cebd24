// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/direction_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/depth_uncertainty.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumSideways = 20;
constexpr int kNumTurning = 30;
constexpr int kNumAhead = 15;

// Sideways over the ground, then a turn on the spot by 90 degrees, then ahead: at the end nothing
// of what was seen at first is in view.
// `hover` moves the camera while it turns, by so many times a few thousandths of the depth.
Sequence FlyAroundACorner(const TexturedGround& ground, double hover) {
  Sequence sequence;
  for (int i = 0; i < kNumSideways + kNumTurning + kNumAhead; ++i) {
    const double aside = std::min(i, kNumSideways);
    const double turned = std::clamp(i - kNumSideways, 0, kNumTurning);
    const double ahead = std::max(i - kNumSideways - kNumTurning, 0);
    const double yaw = std::numbers::pi / 2 * turned / kNumTurning;
    const Eigen::Vector3d forward(std::sin(yaw), std::cos(yaw), -0.5);
    const Eigen::Vector3d drift =
        hover * Eigen::Vector3d(0.03 * std::sin(0.2 * turned), 0.02 * std::sin(0.3 * turned), 0);
    const Eigen::Vector3d eye = Eigen::Vector3d(0.25 * aside + 0.3 * ahead, -2, 10) + drift;
    sequence.T_world_cam.push_back(LookAt(eye, eye + forward));
    Frame frame;
    frame.index = i;
    frame.timestamp_s = 0.1 * i;
    frame.name = "frame " + std::to_string(i);
    frame.camera = SmallCamera();
    frame.bgr = ground.Render(frame.camera, sequence.T_world_cam.back());
    frame.sensor = frame.camera;
    sequence.frames.push_back(std::move(frame));
  }
  return sequence;
}

TEST(DirectionPoints, CarryTheTrackThroughATurnOnTheSpot) {
  const Sequence sequence = FlyAroundACorner(TexturedGround(true), 3);
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::vector<Keyframe> keyframes;
  int num_lost = 0;
  for (const Frame& frame : sequence.frames) {
    TrackingResult result = tracker->Track(frame);
    num_lost += result.status == TrackingStatus::kLost ? 1 : 0;
    for (Keyframe& keyframe : result.finalised_keyframes) keyframes.push_back(std::move(keyframe));
  }
  for (Keyframe& keyframe : tracker->Finish()) keyframes.push_back(std::move(keyframe));
  EXPECT_EQ(num_lost, 0);
  const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
  ASSERT_EQ(trajectory.size(), sequence.frames.size());
  const Pose first = trajectory.front().T_world_cam;
  for (const TrajectoryEntry& entry : trajectory) {
    EXPECT_EQ(entry.map_id, 0);
    const auto i = static_cast<std::size_t>(entry.frame_index);
    const Pose T_first = first.Inverse() * entry.T_world_cam;
    const Pose truth = sequence.T_world_cam[0].Inverse() * sequence.T_world_cam[i];
    EXPECT_LT((T_first.Inverse() * truth).RotationAngle(), 0.01) << i;  // 0.6 of 90 degrees
  }
  // What is handed on has depths where they are known: of what has come into view since the turn
  // began, only where the camera's drift has told them by then.
  const auto middle = std::find_if(keyframes.begin(), keyframes.end(), [](const Keyframe& k) {
    return k.frame.index >= kNumSideways + kNumTurning / 2;
  });
  ASSERT_NE(middle, keyframes.end());
  EXPECT_LT(middle->sparse_depths_su.size(), keyframes.front().sparse_depths_su.size() / 2);
}

// Then nothing tells how far what comes after is: one map would be a wrong one.
TEST(DirectionPoints, MapEndsWhereATurnLeavesTheScaleOpen) {
  const Sequence sequence = FlyAroundACorner(TexturedGround(true), 0);
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  for (const Frame& frame : sequence.frames) static_cast<void>(tracker->Track(frame));
  static_cast<void>(tracker->Finish());
  const std::vector<TrajectoryEntry> trajectory = tracker->Trajectory();
  ASSERT_FALSE(trajectory.empty());
  EXPECT_EQ(trajectory.front().map_id, 0);
  int num_of_first = 0;
  std::int64_t last_of_first = 0;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (i > 0) {
      EXPECT_GT(trajectory[i].frame_index, trajectory[i - 1].frame_index);
    }
    if (trajectory[i].map_id != 0) continue;
    ++num_of_first;
    last_of_first = trajectory[i].frame_index;
  }
  EXPECT_GE(num_of_first, kNumSideways);
  EXPECT_LT(last_of_first, kNumSideways + kNumTurning);  // in the turn, where known points were few
  for (const TrajectoryEntry& entry : tracker->KeyframeTrajectory()) {
    if (entry.map_id == 0) {
      EXPECT_LE(entry.frame_index, last_of_first);
    }
  }
}

// Two keyframes that see one point.
Map MapWithPoint(double baseline, double sigma_px, PointId& point) {
  const CameraModel camera = SmallCamera();
  Map map(0, camera, {});
  const Eigen::Vector3d p_world(0, 0, 10);
  for (const double x : {-baseline / 2, baseline / 2}) {
    const Pose T_cam_world(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
    View view = MakeView(camera, {camera.Project(T_cam_world * p_world)});
    view.features[0].sigma_px = sigma_px;
    view.T_cam_world = T_cam_world;
    map.AddKeyframe(view);
  }
  point = map.AddPoint(p_world);
  map.AddObservation(point, {0, 0});
  map.AddObservation(point, {1, 0});
  map.UpdatePoint(point);
  map.point(point).depth_sigma = kGuessedDepthSigma;
  return map;
}

TEST(DepthUncertainty, IsTheGuessWithoutABaseline) {
  PointId point;
  const Map map = MapWithPoint(0, 0.1, point);
  EXPECT_NEAR(DepthSigma(map, map.point(point)), kGuessedDepthSigma, 1e-12);
}

TEST(DepthUncertainty, IsThatOfTriangulationWithOne) {
  PointId point;
  Map map = MapWithPoint(0.05, 0.1, point);
  // Each image is half the baseline from the mean: the disparity is known to sqrt(2) of a pixel's.
  const double moved_px = map.camera().fx * 0.05 / 10;
  const double by_images = std::sqrt(2) * 0.1 / moved_px;
  const double expected =
      1 / std::sqrt(1 / (by_images * by_images) + 1 / (kGuessedDepthSigma * kGuessedDepthSigma));
  EXPECT_NEAR(DepthSigma(map, map.point(point)), expected, 1e-3 * expected);
  UpdateDepthSigmas(map, 0);
  EXPECT_NEAR(map.point(point).depth_sigma, expected, 1e-3 * expected);
  EXPECT_EQ(ShareOfDirections(map, map.keyframe(0).view), 1);
}

TEST(DepthUncertainty, EndsWhenTheDepthIsKnown) {
  PointId point;
  Map map = MapWithPoint(1, 0.1, point);
  UpdateDepthSigmas(map, 0);
  EXPECT_EQ(map.point(point).depth_sigma, 0);
  EXPECT_TRUE(DepthAxis(map, map.point(point)).isZero(0));
}

TEST(DepthUncertainty, PointMergedWithAKnownOneIsWhereThatIs) {
  PointId vague;
  Map map = MapWithPoint(0, 0.1, vague);
  const PointId known = map.AddPoint({0, 0, 8});
  map.MergePoints(known, vague);
  EXPECT_EQ(map.point(vague).depth_sigma, 0);
  EXPECT_EQ(map.point(vague).p_world, Eigen::Vector3d(0, 0, 8));
}

}  // namespace
}  // namespace mono3d::tracking
