// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kTrackedReadout_s = 0.03;
constexpr int kNumRollingFrames = 60;

CameraModel RollingCamera(double readout_s, bool reads_columns) {
  CameraModel sensor = SmallCamera();
  sensor.shutter = {readout_s, reads_columns};
  return sensor;
}

struct RollingFlight {
  double error = 0;  // root mean square distance from the truth after alignment, over the height
  std::size_t num_tracked = 0;
  std::vector<Keyframe> keyframes;
  SparseModel sparse;
};

RollingFlight TrackFlight(std::vector<Frame> frames, const std::vector<Pose>& truth) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  RollingFlight flight;
  const auto keep = [&](std::vector<Keyframe> keyframes) {
    for (Keyframe& keyframe : keyframes) flight.keyframes.push_back(std::move(keyframe));
  };
  for (const Frame& frame : frames) keep(tracker->Track(frame).finalised_keyframes);
  tracker->WaitForMapping();
  keep(tracker->Finish());
  flight.sparse = tracker->Sparse(0);
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> true_centres;
  for (const TrajectoryEntry& entry : tracker->Trajectory()) {
    found.push_back(entry.T_world_cam.translation());
    true_centres.push_back(truth[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  flight.num_tracked = found.size();
  if (found.size() < 3) return flight;
  const Similarity fit = FitSimilarity(found, true_centres);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    sum += (fit * found[i] - true_centres[i]).squaredNorm();
  }
  flight.error = std::sqrt(sum / static_cast<double>(found.size())) / 10;
  return flight;
}

std::vector<Frame> WithoutSensor(std::vector<Frame> frames) {
  for (Frame& frame : frames) frame.sensor = {};
  return frames;
}

const TexturedGround& RollingGround() {
  static const TexturedGround ground(true);
  return ground;
}

TEST(RollingShutterTracking, IsAsGoodAsWithAGlobalOneWhereTheReadoutIsKnown) {
  const Sequence global =
      FlyUnsteadily(RollingGround(), RollingCamera(0, false), kNumRollingFrames);
  const double with_global = TrackFlight(global.frames, global.T_world_cam).error;
  for (const bool reads_columns : {false, true}) {
    // Columns from the right.
    const double readout_s = reads_columns ? -kTrackedReadout_s : kTrackedReadout_s;
    const Sequence rolling =
        FlyUnsteadily(RollingGround(), RollingCamera(readout_s, reads_columns), kNumRollingFrames);
    const RollingFlight known = TrackFlight(rolling.frames, rolling.T_world_cam);
    const RollingFlight unknown = TrackFlight(WithoutSensor(rolling.frames), rolling.T_world_cam);
    EXPECT_EQ(known.num_tracked, rolling.frames.size());
    EXPECT_LT(known.error, 2 * with_global + 0.0005);
    EXPECT_GT(unknown.error, 3 * known.error);
  }
}

// The velocity of a keyframe and where its points are seen, at the middle line, agree with the
// truth: what depth estimation and calibration go on from.
TEST(RollingShutterTracking, HandsOutVelocities) {
  const Sequence rolling =
      FlyUnsteadily(RollingGround(), RollingCamera(kTrackedReadout_s, false), kNumRollingFrames);
  const RollingFlight flight = TrackFlight(rolling.frames, rolling.T_world_cam);
  ASSERT_GT(flight.keyframes.size(), 6U);
  int num_judged = 0;
  for (const Keyframe& keyframe : flight.keyframes) {
    const auto index = static_cast<std::size_t>(keyframe.frame.index);
    EXPECT_EQ(keyframe.sparse_pixels.size(), keyframe.sparse_depths_su.size());
    EXPECT_EQ(keyframe.frame.sensor.shutter.readout_s, kTrackedReadout_s);
    if (index < 2 || index + 3 > rolling.T_world_cam.size()) continue;
    const Pose T_later_earlier =
        rolling.T_world_cam[index + 1].Inverse() * rolling.T_world_cam[index - 1];
    const CameraVelocity truth = VelocityOf(T_later_earlier, 2 / 30.);
    // The central difference itself is 6 % short of a shake of 3 Hz, 0.11 rad/s; a pose is known to
    // 0.1 px of 345, five poses make a velocity.
    EXPECT_LT((keyframe.velocity.angular_rad_per_s - truth.angular_rad_per_s).norm(), 0.03);
    ++num_judged;
  }
  EXPECT_GT(num_judged, 4);
  ASSERT_FALSE(flight.sparse.images.empty());
  for (const SparseImage& image : flight.sparse.images) EXPECT_TRUE(image.velocity.has_value());
  std::vector<double> errors = ReprojectionErrors_px(flight.sparse);
  double sum = 0;
  for (const double error : errors) sum += error;
  EXPECT_LT(sum / static_cast<double>(errors.size()), 0.3);
}

// How the camera moved during the readout is not known at the start: its way has to be longer. The
// frames before get their poses afterwards.
TEST(RollingShutterTracking, StartsOnceTheWayOutweighsTheMotionDuringTheReadout) {
  constexpr double kReadout_s = 0.025;
  const Sequence rolling =
      FlyUnsteadily(RollingGround(), RollingCamera(kReadout_s, false), kNumRollingFrames);
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::int64_t first_index = -1;
  for (const Frame& frame : rolling.frames) {
    if (tracker->Track(frame).T_world_cam && first_index < 0) first_index = frame.index;
  }
  ASSERT_GE(first_index, 0);
  EXPECT_GE(static_cast<double>(first_index) / 30, 20 * kReadout_s - 1e-9);
  EXPECT_EQ(tracker->Trajectory().size(), rolling.frames.size());
}

// Depth is estimated from keyframes as they are handed out: what a young map gets wrong of how the
// camera turned from one to the next would stay in the model.
TEST(RollingShutterTracking, HandsOutKeyframesOnceTheirMapHasSettled) {
  const Sequence rolling = FlyUnsteadily(RollingGround(), RollingCamera(kTrackedReadout_s, false),
                                         5 * kNumRollingFrames / 2);
  TrackerOptions options;
  options.insertion.max_baseline_share = 0.04;  // so many that a short flight suffices
  const std::unique_ptr<Tracker> tracker = CreateTracker(options);
  std::vector<std::int64_t> ids;
  std::vector<Pose> T_world_cam;  // when they were handed out
  const auto take = [&](const std::vector<Keyframe>& keyframes) {
    for (const Keyframe& keyframe : keyframes) {
      ids.push_back(keyframe.id);
      T_world_cam.push_back(tracker->Poses()->Find(keyframe.id)->S_world_kf.pose());
    }
  };
  for (const Frame& frame : rolling.frames) take(tracker->Track(frame).finalised_keyframes);
  const std::size_t num_in_flight = ids.size();
  EXPECT_GT(num_in_flight, 10U);
  take(tracker->Finish());
  constexpr double kTurn_rad = 0.00035;  // 0.12 px
  for (std::size_t i = 1; i < ids.size(); ++i) {
    const auto turned = [](const Pose& a, const Pose& b) { return (a.Inverse() * b).rotation(); };
    const Eigen::Quaterniond handed_out = turned(T_world_cam[i - 1], T_world_cam[i]);
    const Eigen::Quaterniond last = turned(tracker->Poses()->Find(ids[i - 1])->S_world_kf.pose(),
                                           tracker->Poses()->Find(ids[i])->S_world_kf.pose());
    EXPECT_LT(handed_out.angularDistance(last), kTurn_rad) << "keyframe " << ids[i];
  }
}

// A map that is saved keeps how its keyframes moved.
TEST(RollingShutterTracking, SavesVelocities) {
  const Sequence rolling =
      FlyUnsteadily(RollingGround(), RollingCamera(kTrackedReadout_s, false), 30);
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  for (const Frame& frame : rolling.frames) static_cast<void>(tracker->Track(frame));
  const std::unique_ptr<Tracker> second = CreateTracker();
  second->LoadMap(tracker->SaveMap(), "memory");
  const SparseModel before = tracker->Sparse(0);
  const SparseModel after = second->Sparse(0);
  ASSERT_EQ(before.images.size(), after.images.size());
  ASSERT_FALSE(before.images.empty());
  for (std::size_t i = 0; i < before.images.size(); ++i) {
    EXPECT_EQ(before.images[i].velocity, after.images[i].velocity);
    ASSERT_EQ(before.images[i].observations.size(), after.images[i].observations.size());
    for (std::size_t k = 0; k < before.images[i].observations.size(); ++k) {
      EXPECT_EQ(before.images[i].observations[k].pixel, after.images[i].observations[k].pixel);
    }
  }
}

}  // namespace
}  // namespace mono3d::tracking
