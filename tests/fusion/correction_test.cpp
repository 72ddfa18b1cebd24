// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

TrackedMap Numbered(TrackedMap map, int number) {
  map.keyframe_id = map.frame_index = number;
  return map;
}

// How the tracker's world has drifted by the i-th of the views around the house.
Similarity Drift(int i) {
  return {std::exp(0.004 * i),
          Pose(RotationExp(i * Vector3d(0.001, -0.002, 0.003)), i * Vector3d(0.02, 0.01, -0.015))};
}

// A tracker that drifts sees the house from 0 to 55 degrees, then finds out.
TEST(Correction, BringsADriftedModelToTheTruth) {
  SurfelMapOptions options;
  options.registration.enabled = false;
  const auto drifted = CreateTrackedModel(options);
  std::vector<KeyframePose> moved;
  for (int i = 0; i < 12; ++i) {
    const TrackedMap truth = Numbered(HouseView({}, 5.0 * i), i);
    TrackedMap map = truth;
    const Similarity drift = Drift(i);
    map.T_world_cam = drift * truth.T_world_cam;
    map.depth = truth.depth * drift.scale();
    map.depth_sigma_per_square_depth /= drift.scale();
    (void)drifted->Integrate(map);
    moved.push_back({i, 0, Similarity(1 / drift.scale(), truth.T_world_cam)});
  }
  // Ground lies at z = 0: the root mean square height of what is low.
  const auto ground_error = [&] {
    double sum = 0;
    int count = 0;
    for (const auto& p : drifted->Export(1).points) {
      if (std::abs(p.z()) > 0.4 || std::hypot(p.x(), p.y()) > 8) continue;
      sum += p.z() * p.z();
      ++count;
    }
    return std::sqrt(sum / count);
  };
  const double before = ground_error();
  const std::int64_t num_before = drifted->num_surfels();
  const UpdateResult result = drifted->Update(moved);
  EXPECT_TRUE(result.has_moved);
  const std::vector<FusedDepthMap> maps = drifted->DepthMaps();
  ASSERT_EQ(maps.size(), 12U);
  for (int i = 0; i < 12; ++i) {
    const Pose truth = HouseView({}, 5.0 * i).T_world_cam;
    const FusedDepthMap& map = maps[static_cast<std::size_t>(i)];
    EXPECT_EQ(map.frame_index, i);
    EXPECT_LT((map.S_world_kf.pose().translation() - truth.translation()).norm(), 1e-6);
    EXPECT_NEAR(map.S_world_kf.scale(), 1 / Drift(i).scale(), 1e-9);
  }
  // What was merged while views disagreed stays a compromise, which no motion of it mends: half of
  // the error remains, the rest of the limit is for other devices.
  constexpr double kRemainingShare = 0.57;
  EXPECT_EQ(result.num_surfels, num_before);  // nothing is merged yet
  const double after = ground_error();
  EXPECT_LT(after, kRemainingShare * before);
  EXPECT_LT(drifted->num_surfels(), num_before);  // where it is exported, all is
}

// A map that has just started finds out that its first keyframes are nearer to each other than it
// had them: what was matched with their poses is nearer too, though its own keyframe stays.
TEST(Correction, OfTheViewsOfADepthMapChangesItsDepths) {
  constexpr double kShorter = 0.95;
  TrackedMap map = Numbered(HouseView({}, 0), 1);
  std::vector<KeyframePose> before, after;
  for (const int id : {2, 3}) {
    const Pose T_ref_cam(Eigen::Quaterniond::Identity(), Vector3d(id - 2.5, 0.1, 0));
    const Pose shorter(T_ref_cam.rotation(), kShorter * T_ref_cam.translation());
    map.views.push_back({id, T_ref_cam});
    before.push_back({id, 0, Similarity(1, map.T_world_cam * T_ref_cam)});
    after.push_back({id, 0, Similarity(1, map.T_world_cam * shorter)});
  }
  const auto model = CreateTrackedModel();
  (void)model->Update(before);
  const FusionResult fused = model->Integrate(map);
  EXPECT_NEAR(fused.S_world_kf.scale(), 1, 1e-12);
  const PointCloud as_matched = model->Export(1);
  EXPECT_TRUE(model->Update(after).has_moved);
  EXPECT_NEAR(model->DepthMaps().front().S_world_kf.scale(), kShorter, 1e-9);
  const PointCloud nearer = model->Export(1);
  ASSERT_EQ(nearer.points.size(), as_matched.points.size());
  const Vector3d centre = map.T_world_cam.translation();
  for (std::size_t i = 0; i < nearer.points.size(); ++i) {
    const Vector3d expected = centre + kShorter * (as_matched.points[i].cast<double>() - centre);
    EXPECT_LT((nearer.points[i].cast<double>() - expected).norm(), 1e-4);
  }
  // One that comes late, after the poses have changed, is the same.
  const auto late = CreateTrackedModel();
  (void)late->Update(after);
  EXPECT_NEAR(late->Integrate(map).S_world_kf.scale(), kShorter, 1e-9);
}

TEST(Correction, OfOtherKeyframesChangesNothing) {
  const auto map = CreateTrackedModel();
  (void)map->Integrate(Numbered(HouseView({}, 0), 3));
  const auto before = map->Export(1).points;
  const Similarity far(1, Pose(Eigen::Quaterniond::Identity(), Vector3d(100, 0, 0)));
  EXPECT_FALSE(map->Update(std::vector<KeyframePose>{{4, 0, far}}).has_moved);
  EXPECT_FALSE(map->Update(std::vector<KeyframePose>{{5, 1, far}}).has_moved);
  EXPECT_EQ(map->Export(1).points, before);
}

// The next depth map comes in the corrected world.
TEST(Correction, IsWhereTheNextDepthMapIsExpected) {
  const auto map = CreateTrackedModel();
  const Similarity drift(1.05, Pose(RotationExp({0.05, -0.02, 0.1}), Vector3d(1, 2, 3)));
  TrackedMap first = Numbered(HouseView({}, 0), 0);
  const Pose truth = first.T_world_cam;
  first.T_world_cam = drift * truth;
  first.depth = first.depth * drift.scale();
  first.depth_sigma_per_square_depth /= drift.scale();
  (void)map->Integrate(first);
  (void)map->Update(std::vector<KeyframePose>{{0, 0, Similarity(1 / drift.scale(), truth)}});
  const FusionResult next = map->Integrate(Numbered(HouseView({}, 3), 1));
  EXPECT_EQ(next.status, FusionStatus::kFused) << next.reason;
  EXPECT_TRUE(next.registration.registered);
  EXPECT_FALSE(next.registration.moved);
}

}  // namespace
}  // namespace mono3d
