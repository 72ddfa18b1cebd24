// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/velocity_shortfall.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace mono3d::calibration {
namespace {

// A camera that flies ahead, turns evenly and shakes at `shake_hz`.
std::vector<TrajectoryEntry> Flight(double shake_hz, double frames_per_s, int num_frames = 120) {
  std::vector<TrajectoryEntry> frames;
  for (int i = 0; i < num_frames; ++i) {
    const double t_s = i / frames_per_s;
    const double shake_rad = 0.003 * std::sin(2 * std::numbers::pi * shake_hz * t_s);
    TrajectoryEntry frame;
    frame.frame_index = i;
    frame.timestamp_s = t_s;
    frame.T_world_cam = {RotationExp({shake_rad, 0.2 * t_s, 0}), Eigen::Vector3d(0, 0, 10 * t_s)};
    frames.push_back(frame);
  }
  return frames;
}

double ShareOf(const std::vector<TrajectoryEntry>& frames) {
  VelocityShortfall shortfall;
  shortfall.Add(frames);
  return shortfall.Share();
}

// By two frames on each side velocities of a shake at x radians a frame are (8 sin x - sin 2x) / 6x
// of the true ones.
TEST(VelocityShortfall, IsWhatTwoFramesOnEachSideMissOfAShake) {
  EXPECT_LT(ShareOf(Flight(2, 30)), 0.002);
  EXPECT_NEAR(ShareOf(Flight(4, 30)), 0.015, 0.003);
  EXPECT_NEAR(ShareOf(Flight(2, 10)), 0.063, 0.005);
  EXPECT_NEAR(ShareOf(Flight(3, 10)), 0.2, 0.02);
}

TEST(VelocityShortfall, IsNoneOfASlowMotion) {
  EXPECT_LT(ShareOf(Flight(0.1, 10)), 1e-4);
  EXPECT_EQ(VelocityShortfall().Share(), 0);
}

TEST(VelocityShortfall, IsOfFramesOfOneMapAtEvenTimes) {
  EXPECT_EQ(ShareOf(Flight(3, 10, 8)), 0);
  std::vector<TrajectoryEntry> two_maps = Flight(3, 10, 16);
  for (int i = 8; i < 16; ++i) two_maps[static_cast<std::size_t>(i)].map_id = 1;
  EXPECT_EQ(ShareOf(two_maps), 0);
  std::vector<TrajectoryEntry> with_gaps = Flight(3, 10, 90);
  for (int i = 88; i > 0; i -= 4) with_gaps.erase(with_gaps.begin() + i);
  EXPECT_EQ(ShareOf(with_gaps), 0);
}

}  // namespace
}  // namespace mono3d::calibration
