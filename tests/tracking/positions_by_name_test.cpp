// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tracking/positions/position_following.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr KeyframeId kNumOnArc = 20;
constexpr double kMetresPerUnit = 7;  // of the map's unit

// Ten frames a second along an arc, every one a keyframe.
Pose T_world_cam_OnArc(double time_s) {
  return {RotationExp({0, 0, 0.3 * time_s}),
          {20 * std::sin(0.3 * time_s), 20 * std::cos(0.3 * time_s), 5 + time_s}};
}

struct FollowedFlight {
  Map map{0, SmallCamera(), FeatureOptions{}};
  std::vector<TrajectoryEntry> frames;
};

FollowedFlight FlyOnArc() {
  FollowedFlight flight;
  for (KeyframeId i = 0; i < kNumOnArc; ++i) {
    const double time_s = 0.1 * static_cast<double>(i);
    View view;
    view.frame.index = 3 * static_cast<std::int64_t>(i);
    view.frame.timestamp_s = time_s;
    view.frame.camera = SmallCamera();
    view.T_cam_world = T_world_cam_OnArc(time_s).Inverse();
    flight.map.AddKeyframe(view);
    flight.frames.push_back({view.frame.index, time_s, 0, T_world_cam_OnArc(time_s)});
  }
  return flight;
}

CameraPositions PositionsByName() {
  CameraPositions positions;
  positions.S_metric_map = Similarity(kMetresPerUnit, Pose());
  positions.typical_horizontal_m = positions.typical_vertical_m = 0.1;
  for (KeyframeId i = 0; i < kNumOnArc; ++i) {
    CameraPosition position;
    // As of photographs, one a minute: no time of this video.
    position.time_s = 60 * static_cast<double>(i);
    position.p_m = kMetresPerUnit * T_world_cam_OnArc(0.1 * static_cast<double>(i)).translation();
    position.frame_index = 3 * static_cast<std::int64_t>(i);
    positions.positions.push_back(position);
  }
  return positions;
}

TEST(FollowPositionsByName, TakesPositionsThatBelongToFramesByNameAtTheTimesOfThese) {
  FollowedFlight flight = FlyOnArc();
  CameraPositions positions = PositionsByName();
  MappingLock lock;
  const auto fit = FollowPositions(flight.map, flight.frames, 0, positions, lock);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->num_used, kNumOnArc);
  EXPECT_EQ(fit->num_outliers, 0U);
  // They were right, and so was the path: to what the sigmas of the edges leave.
  EXPECT_LT(fit->rms_moved_m, 0.01 * kMetresPerUnit);
}

TEST(FollowPositionsByName, PassesOverPositionsOfFramesThatHaveNoPose) {
  FollowedFlight flight = FlyOnArc();
  CameraPositions positions = PositionsByName();
  for (std::size_t i = 10; i < positions.positions.size(); ++i) {
    positions.positions[i].frame_index += 1;
  }
  MappingLock lock;
  const auto fit = FollowPositions(flight.map, flight.frames, 0, positions, lock);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->num_used, 10U);
}

}  // namespace
}  // namespace mono3d::tracking
