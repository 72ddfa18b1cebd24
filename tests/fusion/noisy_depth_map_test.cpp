// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

// The tests' views claim a baseline of a tenth of the distance. Here it is half of it: a sigma of
// 0.8 % of the depth.
TrackedMap ExactView(double angle_deg) {
  TrackedMap map = HouseView({}, angle_deg);
  map.depth_sigma_per_square_depth /= 5;
  return map;
}

// As surfaces of hardly any texture come out: wrong by up to `share` of the depth, alike over parts
// of the image of some 30 pixels.
TrackedMap Bent(TrackedMap map, double share) {
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double wave = std::sin(2 * std::numbers::pi * (x + 0.4 * y) / 61) *
                          std::cos(2 * std::numbers::pi * (y - 0.3 * x) / 47);
      map.depth.at<float>(y, x) *= static_cast<float>(1 + share * wave);
    }
  }
  return map;
}

std::unique_ptr<TrackedModel> ModelOfThree() {
  auto map = CreateTrackedModel();
  for (const double angle_deg : {0.0, 3.0, 6.0}) (void)map->Integrate(ExactView(angle_deg));
  return map;
}

// Five and more sigmas, over most of the image: no pose mends that, and the tracker is right.
TEST(NoisyDepthMap, IsFusedWhereTheTrackerHasIt) {
  const auto map = ModelOfThree();
  const TrackedMap bent = Bent(ExactView(9), 0.13);
  const FusionResult result = map->Integrate(bent);
  ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
  EXPECT_GE(result.registration.noise, 1.5);
  EXPECT_LE(result.registration.noise, 6);
  EXPECT_EQ(ImageDistance_px(result.S_world_kf.pose(), bent.T_world_cam), 0);
  EXPECT_TRUE(result.constraints.empty());  // nothing that the tracker should hear of
  EXPECT_FALSE(result.starts_submap);
}

// It hardly counts against what is known better: sigma enters the weight squared.
TEST(NoisyDepthMap, HardlyMovesWhatItConfirms) {
  const auto height_of_ground = [](const TrackedModel& map) {
    double sum = 0;
    double count = 0;
    for (const auto& p : map.Export(3).points) {
      if (std::abs(p.x()) < 1 && p.y() > 3 && p.y() < 4) sum += p.z(), count += 1;
    }
    EXPECT_GT(count, 50);
    return sum / count;
  };
  const auto map = ModelOfThree();
  const double before = height_of_ground(*map);
  ASSERT_EQ(map->Integrate(Bent(ExactView(9), 0.13)).status, FusionStatus::kFused);
  EXPECT_NEAR(height_of_ground(*map), before, 0.02);  // 0.2 % of the distance
}

TEST(NoisyDepthMap, IsToldFromOneOfAnotherScale) {
  for (const double scale : {0.7, 0.8, 1.25}) {
    const auto map = ModelOfThree();
    TrackedMap wrong = Bent(ExactView(9), 0.02);
    wrong.depth = wrong.depth * scale;
    const FusionResult result = map->Integrate(wrong);
    EXPECT_EQ(result.status, FusionStatus::kRejected) << scale;
    EXPECT_EQ(result.rejection, FusionRejection::kNotRegistered) << scale;
  }
}

TEST(NoisyDepthMap, IsToldFromOneAtAWrongPose) {
  for (const Vector3d& off_su : {Vector3d(1.5, 0, 0), Vector3d(0, 1.5, 0), Vector3d(0, 0, 2)}) {
    const auto map = ModelOfThree();
    const TrackedMap wrong = Misplaced(Bent(ExactView(9), 0.13), {0, 0, 0}, off_su, 1);
    const FusionResult result = map->Integrate(wrong);
    if (result.status != FusionStatus::kFused) continue;
    // Where it is fused, the registration has found the way back.
    EXPECT_TRUE(result.registration.moved) << off_su.transpose();
    EXPECT_LT(ImageDistance_px(result.S_world_kf.pose(), ExactView(9).T_world_cam), 2)
        << off_su.transpose();
  }
}

TEST(NoisyDepthMap, IsRefusedWhereNoMoreThanItsClaimIsBelieved) {
  SurfelMapOptions options;
  options.gate.max_noise = 1;
  const auto map = CreateTrackedModel(options);
  for (const double angle_deg : {0.0, 3.0, 6.0}) (void)map->Integrate(ExactView(angle_deg));
  EXPECT_EQ(map->Integrate(Bent(ExactView(9), 0.13)).status, FusionStatus::kRejected);
}

}  // namespace
}  // namespace mono3d
