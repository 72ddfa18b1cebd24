// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/similarity.h"

// The ways in which a model of this kind has died before: each must leave it sound, and tell.
namespace mono3d {
namespace {

using Eigen::Vector3d;

// A view of the house at a number of degrees, which is also its frame.
TrackedMap View(int angle_deg, const HouseScene& scene = {}) {
  TrackedMap map = HouseView(scene, angle_deg);
  map.keyframe_id = map.frame_index = angle_deg;
  return map;
}

double FalseShare(const TrackedModel& model, const std::vector<int>& angles_deg) {
  std::vector<TrackedMap> truth;
  for (const int angle_deg : angles_deg) truth.push_back(View(angle_deg));
  return FalseShare(model.Export(1), truth);
}

// Outlines: surfels of a coarser view stand over an edge by a pixel of a finer one.
constexpr double kMaxFalseShare = 0.02;

struct Tally {
  int num_fused = 0;
  int num_rejected = 0;
  int num_fused_late = 0;
  ModelHealth health;
};

void Add(TrackedModel& model, const TrackedMap& map, Tally& tally) {
  const FusionResult result = model.Integrate(map);
  (result.status == FusionStatus::kFused ? tally.num_fused : tally.num_rejected) += 1;
  for (const RetriedMap& retried : result.retried) {
    tally.num_fused_late += retried.status == FusionStatus::kFused ? 1 : 0;
  }
  tally.health = result.health;
}

// A tracker that has gone astray: all its poses moved by the same motion, farther than a
// registration can find back.
TrackedMap Astray(TrackedMap map) {
  const Pose moved(RotationExp({0.1, 0.15, 0.05}), Vector3d(3, 1, -2));
  map.T_world_cam = moved * map.T_world_cam;
  return map;
}

TEST(Failure, OneWrongPose) {
  const auto model = CreateTrackedModel();
  Tally tally;
  for (int angle = 0; angle <= 24; angle += 3) {
    Add(*model, angle == 12 ? Astray(View(angle)) : View(angle), tally);
  }
  EXPECT_EQ(tally.num_rejected, 1);
  EXPECT_EQ(tally.num_fused, 8);
  EXPECT_EQ(tally.health.state, HealthState::kGood) << tally.health.reason;
  EXPECT_LT(FalseShare(*model, {0, 12, 24}), kMaxFalseShare);
}

TEST(Failure, FiveWrongPosesInARow) {
  const auto model = CreateTrackedModel();
  Tally tally;
  HealthState worst = HealthState::kGood;
  for (int angle = 0; angle <= 57; angle += 3) {
    const bool is_wrong = angle >= 12 && angle < 27;
    Add(*model, is_wrong ? Astray(View(angle)) : View(angle), tally);
    worst = std::max(worst, tally.health.state);
  }
  EXPECT_EQ(worst, HealthState::kBroken);
  EXPECT_EQ(tally.health.state, HealthState::kGood) << tally.health.reason;
  EXPECT_LT(FalseShare(*model, {0, 18, 39, 57}), kMaxFalseShare);
}

TEST(Failure, NoDepthForLongAndThenLittleOverlap) {
  const auto model = CreateTrackedModel();
  Tally tally;
  for (const int angle : {0, 3, 6, 70, 73, 76, 79}) Add(*model, View(angle), tally);
  EXPECT_EQ(tally.num_fused, 7);
  EXPECT_EQ(tally.health.state, HealthState::kGood) << tally.health.reason;
  EXPECT_LT(FalseShare(*model, {0, 6, 70, 79}), kMaxFalseShare);
}

TEST(Failure, FlatGroundWithAWrongPose) {
  HouseScene flat;
  flat.with_house = false;
  const auto model = CreateTrackedModel();
  Tally tally;
  for (int angle = 0; angle <= 24; angle += 3) {
    TrackedMap map = View(angle, flat);
    if (angle == 12) map = Misplaced(map, {0, 0, 0}, {0.3, -0.2, 0.2}, 1);
    Add(*model, map, tally);
  }
  EXPECT_GE(tally.num_fused, 8);
  EXPECT_EQ(tally.health.state, HealthState::kGood) << tally.health.reason;
  double largest = 0;
  for (const auto& p : model->Export(1).points) {
    if (p.norm() < 12) largest = std::max(largest, std::abs(static_cast<double>(p.z())));
  }
  EXPECT_LT(largest, 0.2);  // a fiftieth of the distance
}

// What was refused fits once the model shows more of the scene.
TEST(Failure, TriesARefusedMapAgain) {
  SurfelMapOptions options;
  options.gate.min_overlap = 0.01;
  const auto model = CreateTrackedModel(options);
  Tally tally;
  // The first depth map is wrong itself: the others contradict it, until the majority has its way.
  TrackedMap wrong = View(0);
  wrong.depth = wrong.depth * 0.7;
  Add(*model, wrong, tally);
  for (int angle = 3; angle <= 24; angle += 3) Add(*model, View(angle), tally);
  EXPECT_GT(tally.num_fused_late, 0);
  EXPECT_EQ(tally.health.state, HealthState::kGood) << tally.health.reason;
  EXPECT_LT(FalseShare(*model, {3, 12, 24}), kMaxFalseShare);
}

}  // namespace
}  // namespace mono3d
