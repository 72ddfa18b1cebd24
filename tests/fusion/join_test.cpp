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

DepthMap View(int angle_deg) {
  DepthMap map = HouseView({}, angle_deg);
  map.keyframe_id = map.frame_index = angle_deg;
  return map;
}

DepthMap InOtherWorld(int angle_deg) {
  DepthMap map = View(angle_deg);
  map.map_id = 1;
  map.T_world_cam = OtherWorld() * map.T_world_cam;
  map.depth = map.depth * OtherWorld().scale();
  map.depth_sigma_per_square_depth /= OtherWorld().scale();
  return map;
}

std::vector<KeyframeCorrection> Corrections(const std::vector<int>& angles_deg) {
  std::vector<KeyframeCorrection> corrections;
  for (const int angle : angles_deg) {
    corrections.push_back({angle, 0, View(angle).T_world_cam, 1 / OtherWorld().scale()});
  }
  return corrections;
}

double FromTruth_px(std::int64_t angle_deg, const Pose& pose) {
  return ImageDistance_px(pose, HouseView({}, static_cast<double>(angle_deg)).T_world_cam);
}

// Poses in double precision, there and back.
constexpr double kRounding_px = 1e-6;

// Keyframe 12 is no more when the maps become one: its depth map moves as the world does.
TEST(Join, PutsEveryDepthMapWhereItsKeyframeIs) {
  const auto model = CreateSurfelMap(TestDevice());
  const auto other = CreateSurfelMap(TestDevice());
  for (const int angle : {0, 4, 8}) (void)model->Integrate(View(angle));
  for (const int angle : {6, 10, 12}) (void)other->Integrate(InOtherWorld(angle));
  const std::int64_t num_before = model->num_surfels() + other->num_surfels();
  const std::vector<KeyframeCorrection> corrections = Corrections({6, 10});
  const auto joined = model->Join(*other, {0, OtherWorld().Inverse(), corrections});
  ASSERT_TRUE(joined.has_value());
  EXPECT_EQ(joined->views.size(), 6U);
  for (const MovedView& view : joined->views) {
    EXPECT_LT(FromTruth_px(view.frame_index, view.T_world_cam), kRounding_px);
    EXPECT_NEAR(view.scale, view.frame_index % 4 == 0 && view.frame_index < 12 ? 1 : 0.5, 1e-9);
  }
  EXPECT_GT(joined->num_merged, 0);
  EXPECT_EQ(model->num_surfels(), num_before - joined->num_merged);
  EXPECT_EQ(other->num_surfels(), 0);
  // What comes next is of one model, and so is a correction.
  const FusionResult next = model->Integrate(View(9));
  EXPECT_EQ(next.status, FusionStatus::kFused) << next.reason;
  EXPECT_FALSE(next.registration.moved);
  EXPECT_EQ(next.health.num_submaps, 1);  // it showed both
  EXPECT_EQ(model->Correct(Corrections({6, 10})).views.size(), 7U);
}

// What waited in the other model is tried again in this one, where its keyframe is now.
TEST(Join, TakesOverWhatWaits) {
  const auto model = CreateSurfelMap(TestDevice());
  const auto other = CreateSurfelMap(TestDevice());
  for (const int angle : {0, 4, 8}) (void)model->Integrate(View(angle));
  (void)other->Integrate(InOtherWorld(6));
  DepthMap astray = InOtherWorld(10);
  astray.T_world_cam =
      Pose(RotationExp({0.1, 0.15, 0.05}), Vector3d(6, 2, -4)) * astray.T_world_cam;
  ASSERT_TRUE(other->Integrate(astray).is_waiting);
  const std::vector<KeyframeCorrection> corrections = Corrections({6, 10});
  ASSERT_TRUE(model->Join(*other, {0, OtherWorld().Inverse(), corrections}).has_value());
  const FusionResult next = model->Integrate(View(12));
  ASSERT_EQ(next.retried.size(), 1U);
  EXPECT_EQ(next.retried[0].frame_index, 10);
  EXPECT_EQ(next.retried[0].status, FusionStatus::kFused);
  EXPECT_LT(FromTruth_px(10, next.retried[0].T_world_cam), kRounding_px);
}

TEST(Join, IntoAnEmptyModelIsAMove) {
  const auto model = CreateSurfelMap(TestDevice());
  const auto other = CreateSurfelMap(TestDevice());
  (void)other->Integrate(InOtherWorld(0));
  const std::int64_t num_surfels = other->num_surfels();
  const auto joined = model->Join(*other, {0, OtherWorld().Inverse(), {}});
  ASSERT_TRUE(joined.has_value());
  EXPECT_EQ(model->num_surfels(), num_surfels);
  EXPECT_FALSE(model->Integrate(View(4)).registration.moved);
}

class StrangeMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap&) override { return {}; }
  CorrectionResult Correct(std::span<const KeyframeCorrection>) override { return {}; }
  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }
};

TEST(Join, RefusesItselfAndModelsOfAnotherKind) {
  const auto model = CreateSurfelMap(TestDevice());
  (void)model->Integrate(View(0));
  const std::int64_t num_surfels = model->num_surfels();
  StrangeMap strange;
  EXPECT_FALSE(model->Join(strange, {}).has_value());
  EXPECT_FALSE(model->Join(*model, {}).has_value());
  EXPECT_FALSE(strange.Join(*model, {}).has_value());
  EXPECT_EQ(model->num_surfels(), num_surfels);
}

TEST(Join, RefusesWhatThereIsNoRoomFor) {
  SurfelMapOptions options;
  options.max_surfels = 20'000;  // a view has some 13,000
  const auto model = CreateSurfelMap(TestDevice(), options);
  const auto other = CreateSurfelMap(TestDevice());
  (void)model->Integrate(View(0));
  (void)other->Integrate(InOtherWorld(4));
  const std::int64_t num_surfels = other->num_surfels();
  EXPECT_FALSE(model->Join(*other, {0, OtherWorld().Inverse(), {}}).has_value());
  EXPECT_EQ(other->num_surfels(), num_surfels);
}

}  // namespace
}  // namespace mono3d
