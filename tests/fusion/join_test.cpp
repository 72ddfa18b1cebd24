// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

// The world of the second map of the tracker, twice as large.
Similarity OtherWorld() { return {2, Pose(RotationExp({0.3, 0.1, -0.5}), Vector3d(40, -7, 3))}; }

TrackedMap View(int angle_deg) {
  TrackedMap map = HouseView({}, angle_deg);
  map.keyframe_id = map.frame_index = angle_deg;
  return map;
}

TrackedMap InOtherWorld(int angle_deg) {
  TrackedMap map = View(angle_deg);
  map.map_id = 1;
  map.T_world_cam = OtherWorld() * map.T_world_cam;
  map.depth = map.depth * OtherWorld().scale();
  map.depth_sigma_per_square_depth /= OtherWorld().scale();
  return map;
}

std::vector<KeyframePose> InThisWorld(const std::vector<int>& angles_deg) {
  std::vector<KeyframePose> poses;
  for (const int angle : angles_deg) {
    poses.push_back({angle, 0, Similarity(1 / OtherWorld().scale(), View(angle).T_world_cam)});
  }
  return poses;
}

double FromTruth_px(std::int64_t angle_deg, const Pose& pose) {
  return ImageDistance_px(pose, HouseView({}, static_cast<double>(angle_deg)).T_world_cam);
}

// Poses in double precision, there and back.
constexpr double kRounding_px = 1e-6;

TEST(Join, PutsEveryDepthMapWhereItsKeyframeIs) {
  const auto model = CreateTrackedModel();
  const auto other = CreateTrackedModel();
  for (const int angle : {0, 4, 8}) (void)model->Integrate(View(angle));
  for (const int angle : {6, 10, 12}) (void)other->Integrate(InOtherWorld(angle));
  const std::int64_t num_before = model->num_surfels() + other->num_surfels();
  const auto joined = model->Join(*other, InThisWorld({6, 10, 12}));
  ASSERT_TRUE(joined.has_value());
  EXPECT_EQ(model->DepthMaps().size(), 6U);
  for (const FusedDepthMap& map : model->DepthMaps()) {
    EXPECT_LT(FromTruth_px(map.frame_index, map.S_world_kf.pose()), kRounding_px);
    const bool is_own = map.frame_index % 4 == 0 && map.frame_index < 12;
    EXPECT_NEAR(map.S_world_kf.scale(), is_own ? 1 : 0.5, 1e-9);
  }
  EXPECT_GT(joined->num_merged, 0);
  EXPECT_EQ(model->num_surfels(), num_before - joined->num_merged);
  EXPECT_EQ(other->num_surfels(), 0);
  // What comes next is of one model.
  const FusionResult next = model->Integrate(View(9));
  EXPECT_EQ(next.status, FusionStatus::kFused) << next.reason;
  EXPECT_FALSE(next.registration.moved);
  EXPECT_EQ(next.health.num_submaps, 1);  // it showed both
  EXPECT_EQ(model->DepthMaps().size(), 7U);
}

// What waited in the other model is tried again in this one, where its keyframe is now.
TEST(Join, TakesOverWhatWaits) {
  const auto model = CreateTrackedModel();
  const auto other = CreateTrackedModel();
  for (const int angle : {0, 4, 8}) (void)model->Integrate(View(angle));
  (void)other->Integrate(InOtherWorld(6));
  TrackedMap astray = InOtherWorld(10);
  astray.T_world_cam =
      Pose(RotationExp({0.1, 0.15, 0.05}), Vector3d(6, 2, -4)) * astray.T_world_cam;
  ASSERT_TRUE(other->Integrate(astray).is_waiting);
  ASSERT_TRUE(model->Join(*other, InThisWorld({6, 10})).has_value());
  const FusionResult next = model->Integrate(View(12));
  ASSERT_EQ(next.retried.size(), 1U);
  EXPECT_EQ(next.retried[0].frame_index, 10);
  EXPECT_EQ(next.retried[0].status, FusionStatus::kFused);
  for (const FusedDepthMap& map : model->DepthMaps()) {
    EXPECT_LT(FromTruth_px(map.frame_index, map.S_world_kf.pose()), kRounding_px);
  }
}

TEST(Join, IntoAnEmptyModelIsAMove) {
  const auto model = CreateTrackedModel();
  const auto other = CreateTrackedModel();
  (void)other->Integrate(InOtherWorld(0));
  const std::int64_t num_surfels = other->num_surfels();
  const auto joined = model->Join(*other, InThisWorld({0}));
  ASSERT_TRUE(joined.has_value());
  EXPECT_EQ(model->num_surfels(), num_surfels);
  EXPECT_FALSE(model->Integrate(View(4)).registration.moved);
}

class StrangeMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap&, const KeyframePoses&) override { return {}; }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return {}; }
  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }
};

TEST(Join, RefusesItselfAndModelsOfAnotherKind) {
  const auto model = CreateTrackedModel();
  (void)model->Integrate(View(0));
  const std::int64_t num_surfels = model->num_surfels();
  StrangeMap strange;
  const KeyframePoses poses = model->Poses();
  EXPECT_FALSE(model->model().Join(strange, poses).has_value());
  EXPECT_FALSE(model->model().Join(model->model(), poses).has_value());
  EXPECT_FALSE(strange.Join(model->model(), poses).has_value());
  EXPECT_EQ(model->num_surfels(), num_surfels);
}

TEST(Join, RefusesWhatThereIsNoRoomFor) {
  SurfelMapOptions options;
  options.max_surfels = 20'000;  // a view has some 13,000
  const auto model = CreateTrackedModel(options);
  const auto other = CreateTrackedModel();
  (void)model->Integrate(View(0));
  (void)other->Integrate(InOtherWorld(4));
  const std::int64_t num_surfels = other->num_surfels();
  EXPECT_FALSE(model->Join(*other, InThisWorld({4})).has_value());
  EXPECT_EQ(other->num_surfels(), num_surfels);
}

}  // namespace
}  // namespace mono3d
