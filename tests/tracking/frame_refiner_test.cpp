// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/frame_refiner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumRefinedFrames = 13;
constexpr int kKeyframeInterval = 4;
constexpr int kMinRefinedInliers = 30;
constexpr double kRefinedReadout_s = 0.03;

// At 30 frames a second; shaking by a degree at 3 Hz.
double TimeOf(int frame) { return frame / 30.; }

Pose TruePoseAt(double time_s) {
  const double swing = 0.02 * std::sin(2 * M_PI * 3 * time_s);
  return {RotationExp({swing, -0.5 * swing, 0}), Eigen::Vector3d(-0.6 * time_s, 0.1, 0)};
}

CameraVelocity TrueVelocityAt(double time_s) {
  constexpr double kStep_s = 1e-4;
  return VelocityOf(TruePoseAt(time_s + kStep_s) * TruePoseAt(time_s - kStep_s).Inverse(),
                    2 * kStep_s);
}

// Keyframes at every fourth frame, where they are; the frames between are `off`.
class RefinedFlight {
 public:
  RefinedFlight(double readout_s, const Pose& off) : atlas_(FeatureOptions{}) {
    sensor_.shutter.readout_s = readout_s;
    std::mt19937 random(SeedFromTestName());
    for (int k = 0; k < 80; ++k) {
      points_.emplace_back(Uniform(random, -2, 2), Uniform(random, -1, 1), Uniform(random, 5, 8));
    }
    atlas_.StartMap(SmallCamera());
    std::vector<View> views;
    for (int i = 0; i < kNumRefinedFrames; ++i) views.push_back(Show(i));
    for (int i = 0; i < kNumRefinedFrames; i += kKeyframeInterval) {
      atlas_.AddKeyframe(views[static_cast<std::size_t>(i)]);
    }
    Map& map = atlas_.map();
    for (std::size_t k = 0; k < points_.size(); ++k) {
      ids_.push_back(map.AddPoint(points_[k]));
      for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
        map.AddObservation(ids_.back(), {id, k});
      }
      map.UpdatePoint(ids_.back());
    }
    atlas_.EndStart();
    for (int i = 0; i < kNumRefinedFrames; ++i) {
      View& view = views[static_cast<std::size_t>(i)];
      view.points.assign(ids_.begin(), ids_.end());
      if (i % kKeyframeInterval != 0) view.T_cam_world = off * view.T_cam_world;
      refiner_.Add(atlas_.AddFrame(view, static_cast<KeyframeId>(i / kKeyframeInterval)), view);
    }
  }

  FrameRefiner& refiner() { return refiner_; }
  Map& map() { return atlas_.map(); }

  void RefineAll() {
    MappingLock alone;
    refiner_.RefineAll(alone);
  }
  void Finalise(KeyframeId keyframe) { map().keyframe(keyframe).is_finalised = true; }

  // As those of a map that was loaded.
  void AddKeyframeWithoutFrame() {
    View earlier = map().keyframe(0).view;
    earlier.frame.index = -1;
    earlier.points.assign(earlier.features.size(), std::nullopt);
    map().AddKeyframe(earlier);
  }

  void AddFrameBefore(int frame) {
    View view = Show(frame);
    view.frame.index = frame - 1;
    view.points.assign(ids_.begin(), ids_.end());
    refiner_.Add(atlas_.AddFrame(view, 0), view);
  }

  double PositionError(int frame) const {
    const Pose found = atlas_.T_cam_world(static_cast<std::size_t>(frame));
    return (found.Inverse().translation() - TruePoseAt(TimeOf(frame)).Inverse().translation())
        .norm();
  }

 private:
  View Show(int i) const {
    const ShutterMotion shutter(sensor_, TrueVelocityAt(TimeOf(i)));
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector3d& p : points_) {
      pixels.push_back(shutter.Project(SmallCamera(), TruePoseAt(TimeOf(i)) * p));
    }
    View view = MakeView(SmallCamera(), pixels);
    view.frame.index = i;
    view.frame.timestamp_s = TimeOf(i);
    view.frame.sensor = sensor_;
    view.T_cam_world = TruePoseAt(TimeOf(i));
    return view;
  }

  CameraModel sensor_ = SmallCamera();
  std::vector<Eigen::Vector3d> points_;
  std::vector<PointId> ids_;
  Atlas atlas_;
  FrameRefiner refiner_{&atlas_, kMinRefinedInliers};
};

const Pose& Off() {
  static const Pose off(RotationExp({0.003, -0.002, 0.001}), Eigen::Vector3d(0.02, -0.01, 0.03));
  return off;
}

TEST(FrameRefiner, MovesFramesOnceTheKeyframesOnBothSidesAreFinal) {
  RefinedFlight flight(0, Off());
  flight.Finalise(0);
  flight.Finalise(1);
  flight.refiner().Refine();
  EXPECT_LT(flight.PositionError(1), 1e-6);
  EXPECT_LT(flight.PositionError(7), 1e-6);
  EXPECT_GT(flight.PositionError(9), 0.01);   // its next keyframe is still to be adjusted
  EXPECT_LT(flight.PositionError(4), 1e-12);  // keyframes stay
  flight.refiner().Finish();
  EXPECT_LT(flight.PositionError(9), 1e-6);
}

TEST(FrameRefiner, LeavesFramesWhosePointsAreGone) {
  RefinedFlight flight(0, Off());
  const double before = flight.PositionError(1);
  std::vector<PointId> points = flight.map().PointIds();
  points.resize(points.size() - kMinRefinedInliers + 1);
  for (const PointId point : points) flight.map().RemovePoint(point);
  flight.refiner().Finish();
  EXPECT_EQ(flight.PositionError(1), before);
}

// Nobody has told it a velocity.
TEST(FrameRefiner, FindsVelocitiesOfARollingShutter) {
  RefinedFlight flight(kRefinedReadout_s, Off());
  for (int i = 0; i < 3; ++i) flight.RefineAll();
  // Frame 1 has one frame before it, frame 6 two on each side.
  EXPECT_LT(flight.PositionError(6), 0.002);
  EXPECT_LT(flight.PositionError(1), 0.01);
  const CameraVelocity found = flight.map().keyframe(1).view.shutter.velocity();
  const CameraVelocity truth = TrueVelocityAt(TimeOf(kKeyframeInterval));
  EXPECT_LT((found.angular_rad_per_s - truth.angular_rad_per_s).norm(),
            0.05 * truth.angular_rad_per_s.norm());
}

// So that all of it can be settled at its end, however long ago its first keyframes were final.
TEST(FrameRefiner, HoldsTheFramesOfAWholeMapWithARollingShutter) {
  const auto refine_all_final = [](RefinedFlight& flight) {
    for (KeyframeId id = 0; id < flight.map().keyframes().size(); ++id) flight.Finalise(id);
    flight.refiner().Refine();
    return flight.refiner().HoldsWholeMap();
  };
  RefinedFlight rolling(kRefinedReadout_s, Off());
  EXPECT_TRUE(rolling.refiner().HoldsWholeMap());
  EXPECT_TRUE(refine_all_final(rolling));
  rolling.refiner().Finish();
  EXPECT_FALSE(rolling.refiner().HoldsWholeMap());
  RefinedFlight global(0, Off());
  EXPECT_FALSE(refine_all_final(global));
  RefinedFlight with_earlier(kRefinedReadout_s, Off());
  with_earlier.AddKeyframeWithoutFrame();
  EXPECT_FALSE(with_earlier.refiner().HoldsWholeMap());
}

// They lack the earlier frames that their velocities were taken from.
TEST(FrameRefiner, LeavesTheFirstFramesWhereEarlierOnesAreGone) {
  RefinedFlight flight(kRefinedReadout_s, Off());
  flight.AddKeyframeWithoutFrame();
  for (const KeyframeId id : {0, 1, 4}) flight.Finalise(id);
  flight.refiner().Refine();  // up to frame 7, of which 2 to 7 are kept
  const double before = flight.PositionError(6);
  const double of_later = flight.PositionError(9);
  flight.RefineAll();
  EXPECT_EQ(flight.PositionError(6), before);
  EXPECT_NE(flight.PositionError(9), of_later);
}

// Those that were to be refined still are, wherever the new one comes among them.
TEST(FrameRefiner, LetsTrackingAddFramesMeanwhile) {
  RefinedFlight flight(0, Off());
  for (KeyframeId id = 0; id < flight.map().keyframes().size(); ++id) flight.Finalise(id);
  // Six at the beginning are left out.
  for (const int frame : {0, -1, -2, -3, -4, -5}) flight.AddFrameBefore(frame);
  PriorityMutex mutex;
  const std::atomic<bool> is_interrupted = false;
  std::atomic<bool> has_begun = false;
  std::thread mapping;
  {
    const TrackingLock tracking(mutex);
    mapping = std::thread([&] {
      has_begun = true;
      MappingLock lock(mutex, is_interrupted);
      flight.refiner().RefineAll(lock);
    });
    while (!has_begun) std::this_thread::yield();
  }
  {
    const TrackingLock tracking(mutex);
    for (const int frame : {-6, -7, -8}) flight.AddFrameBefore(frame);
  }
  mapping.join();
  for (int i = 0; i < kNumRefinedFrames - 1; ++i) EXPECT_LT(flight.PositionError(i), 1e-6) << i;
}

TEST(FrameRefiner, ForgetsFramesThatWereRemoved) {
  RefinedFlight flight(0, Off());
  flight.refiner().ForgetFrom(6);
  flight.refiner().Finish();
  EXPECT_LT(flight.PositionError(5), 1e-6);
  EXPECT_GT(flight.PositionError(6), 0.01);
}

}  // namespace
}  // namespace mono3d::tracking
