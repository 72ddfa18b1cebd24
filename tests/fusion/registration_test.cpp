// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

SurfelMapOptions Registered() {
  SurfelMapOptions options;
  options.registration.enabled = true;
  return options;
}

// The tracker hardly counts: what the registration alone can do.
SurfelMapOptions Unbiased() {
  SurfelMapOptions options = Registered();
  options.registration.prior_px = 100;
  options.registration.prior_scale = 1;
  return options;
}

// One view from the front and one from 4 degrees aside, the second as a tracker would have it that
// errs by about 2 px and by `scale`.
FusionResult RegisterSecondView(const HouseScene& scene, double scale,
                                const SurfelMapOptions& options) {
  const auto map = CreateTrackedModel(options);
  (void)map->Integrate(HouseView(scene, 0));
  const double size = scene.world_scale;
  return map->Integrate(Misplaced(HouseView(scene, 4), Vector3d(0.006, -0.008, 0.005),
                                  size * Vector3d(0.06, -0.05, 0.04), scale));
}

// A tenth of a pixel is what is left of colours and surfaces that are sampled pixel by pixel.
constexpr double kTolerance_px = 0.1;
constexpr double kScaleTolerance = 0.002;

TEST(Registration, FindsPoseAndScale) {
  const FusionResult result = RegisterSecondView({}, 1.02, Unbiased());
  ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
  EXPECT_TRUE(result.registration.registered);
  EXPECT_LT(ImageDistance_px(result.S_world_kf.pose(), HouseView({}, 4).T_world_cam),
            kTolerance_px);
  EXPECT_NEAR(result.S_world_kf.scale(), 1.02, kScaleTolerance);
  EXPECT_GT(result.registration.agreement, 0.9);
  EXPECT_GT(result.registration.deviation_px, 1);
}

TEST(Registration, LeavesTheDepthMapAsItWasHandedIn) {
  const auto map = CreateTrackedModel(Unbiased());
  (void)map->Integrate(HouseView({}, 0));
  // The third is looked for with the second's scale as well.
  for (const double angle_deg : {4.0, 8.0}) {
    const TrackedMap view =
        Misplaced(HouseView({}, angle_deg), {0.006, -0.008, 0.005}, {0.06, -0.05, 0.04}, 1.02);
    const cv::Mat before = view.depth.clone();
    const FusionResult result = map->Integrate(view);
    ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
    ASSERT_NE(result.S_world_kf.scale(), 1);
    EXPECT_EQ(cv::countNonZero(view.depth != before), 0) << angle_deg;
  }
}

TEST(Registration, LeavesTheScaleAloneWhenAskedTo) {
  SurfelMapOptions options = Unbiased();
  options.registration.with_scale = false;
  const FusionResult result = RegisterSecondView({}, 1, options);
  EXPECT_EQ(result.S_world_kf.scale(), 1);
  EXPECT_LT(ImageDistance_px(result.S_world_kf.pose(), HouseView({}, 4).T_world_cam),
            kTolerance_px);
}

TEST(Registration, IsHeldByGreyValuesOnFlatGround) {
  HouseScene flat;
  flat.with_house = false;
  const Pose truth = HouseView(flat, 4).T_world_cam;
  const FusionResult with_grey = RegisterSecondView(flat, 1, Unbiased());
  EXPECT_LT(ImageDistance_px(with_grey.S_world_kf.pose(), truth), kTolerance_px);
  SurfelMapOptions options = Unbiased();
  options.registration.with_grey = false;
  const FusionResult without = RegisterSecondView(flat, 1, options);
  // On a plane three of six unknowns are anybody's guess.
  EXPECT_GT(ImageDistance_px(without.S_world_kf.pose(), truth), 5 * kTolerance_px);
}

TEST(Registration, StaysWithTheTrackerWhereNothingHoldsIt) {
  HouseScene bare;
  bare.with_house = false;
  bare.with_texture = false;
  // A motion along the ground, which shows nowhere but at the image's border.
  const auto map = CreateTrackedModel(Registered());
  (void)map->Integrate(HouseView(bare, 0));
  const TrackedMap second = HouseView(bare, 4);
  const FusionResult result = map->Integrate(second);
  ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
  EXPECT_LT(ImageDistance_px(result.S_world_kf.pose(), second.T_world_cam), kTolerance_px);
}

// Of a pose that is too high over grey ground, and off along it, the model knows the height alone:
// that is set right, and along the ground the prior holds the depth map where the tracker has it.
TEST(Registration, DoesNotSlideAlongGreyGround) {
  HouseScene bare;
  bare.with_house = false;
  bare.with_texture = false;
  const auto view = [&](int x_su, const Vector3d& off_su) {
    TrackedMap map = HouseViewFrom(bare, PoseOver(x_su, 0));
    map.depth_sigma_per_square_depth /= 5;  // of a baseline of half the distance
    map.T_world_cam = Pose(map.T_world_cam.rotation(), map.T_world_cam.translation() + off_su);
    return map;
  };
  const auto map = CreateTrackedModel(Registered());
  for (int x_su = 0; x_su < 3; ++x_su) (void)map->Integrate(view(x_su, {0, 0, 0}));
  for (int x_su = 3; x_su < 9; ++x_su) {
    const double sign = x_su % 2 == 0 ? 1 : -1;
    const TrackedMap off = view(x_su, {0.3 * sign, -0.2 * sign, 0.25});
    const FusionResult result = map->Integrate(off);
    ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
    const Vector3d moved = result.S_world_kf.pose().translation() - off.T_world_cam.translation();
    // In shares of the distance: a fifth of a pixel along the ground.
    EXPECT_LT(std::hypot(moved.x(), moved.y()), 0.016) << moved.transpose();
    EXPECT_NEAR(moved.z(), -0.25, 0.05);
    EXPECT_GT(result.registration.uncertainty_px, 5);
  }
}

TEST(Registration, DoesNotDependOnTheScaleOfTheWorld) {
  HouseScene large;
  large.world_scale = 1000;
  const FusionResult one = RegisterSecondView({}, 1.02, Registered());
  const FusionResult other = RegisterSecondView(large, 1.02, Registered());
  const Pose shrunk(other.S_world_kf.pose().rotation(),
                    other.S_world_kf.pose().translation() / 1000);
  constexpr double kRounding_px = 0.01;  // surfels on a border, summed in single precision
  EXPECT_LT(ImageDistance_px(one.S_world_kf.pose(), shrunk), kRounding_px);
  EXPECT_NEAR(one.S_world_kf.scale(), other.S_world_kf.scale(), 1e-4);
}

TEST(Registration, FollowsAChangeOfExposure) {
  const auto map = CreateTrackedModel(Unbiased());
  (void)map->Integrate(HouseView({}, 0));
  TrackedMap second = Misplaced(HouseView({}, 4), {0.006, -0.008, 0.005}, {0.06, -0.05, 0.04}, 1);
  second.bgr = second.bgr * 0.7 + cv::Scalar(15, 15, 15);
  const FusionResult result = map->Integrate(second);
  EXPECT_LT(ImageDistance_px(result.S_world_kf.pose(), HouseView({}, 4).T_world_cam),
            kTolerance_px);
}

TEST(Registration, RefusesAWrongPoseAndGoesOn) {
  const auto map = CreateTrackedModel(Registered());
  (void)map->Integrate(HouseView({}, 0));
  (void)map->Integrate(HouseView({}, 3));
  const PointCloud before = map->Export(1);
  // The tracker has gone astray: the view from 9 degrees comes with a pose 3 su away.
  const FusionResult wrong =
      map->Integrate(Misplaced(HouseView({}, 9), {0.1, 0.15, 0.05}, {2, 1, -2}, 1));
  EXPECT_EQ(wrong.status, FusionStatus::kRejected);
  EXPECT_EQ(wrong.rejection, FusionRejection::kNotRegistered);
  EXPECT_THAT(wrong.reason, ::testing::HasSubstr("not registered with the model"));
  EXPECT_EQ(map->Export(1).points, before.points);
  EXPECT_EQ(map->Export(1).observations, before.observations);
  const FusionResult next = map->Integrate(HouseView({}, 6));
  EXPECT_EQ(next.status, FusionStatus::kFused) << next.reason;
  EXPECT_LT(ImageDistance_px(next.S_world_kf.pose(), HouseView({}, 6).T_world_cam),
            2 * kTolerance_px);
}

TEST(Registration, ExpectsTheNextMapWhereTheLastOneWasFound) {
  const auto map = CreateTrackedModel(Unbiased());
  (void)map->Integrate(HouseView({}, 0));
  // From here on the tracker's world is turned, moved and 2 % too small.
  const Pose turned(RotationExp({0.004, -0.003, 0.005}), Vector3d(0.05, 0.04, -0.03));
  const auto of_tracker = [&](double angle_deg) {
    TrackedMap view = Misplaced(HouseView({}, angle_deg), {0, 0, 0}, {0, 0, 0}, 1.02);
    view.T_world_cam =
        turned * Pose(view.T_world_cam.rotation(), view.T_world_cam.translation() / 1.02);
    return view;
  };
  const FusionResult second = map->Integrate(of_tracker(3));
  const FusionResult third = map->Integrate(of_tracker(6));
  EXPECT_GT(second.registration.deviation_px, 0.5);
  // Four looks at either place, and no search.
  EXPECT_EQ(third.registration.num_iterations, 8);
  EXPECT_NEAR(third.S_world_kf.scale(), 1.02, kScaleTolerance);
  EXPECT_LT(ImageDistance_px(third.S_world_kf.pose(), HouseView({}, 6).T_world_cam), kTolerance_px);
}

// Where images are noisy, so are the poses: the same misfit contradicts nothing.
TEST(Registration, ExpectsMoreMisfitOfNoisyImages) {
  TrackedMap off = Misplaced(HouseView({}, 4), {0.0012, -0.0018, 0.0012}, {0, 0, 0}, 1);
  for (const double noise : {1., 2.5}) {
    const auto map = CreateTrackedModel(Registered());
    (void)map->Integrate(HouseView({}, 0));
    off.patch_noise = noise;
    const FusionResult result = map->Integrate(off);
    ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
    EXPECT_GT(result.registration.tracker_misfit, 0.25);
    EXPECT_LT(result.registration.tracker_misfit, 0.5);
    EXPECT_EQ(result.registration.moved, noise == 1);
  }
}

// Poses that were all adjusted together stand: a depth map that errs is judged, and not moved.
TEST(Registration, MovesNothingWhereItIsTold) {
  SurfelMapOptions options = Registered();
  options.registration.moves = false;
  const auto map = CreateTrackedModel(options);
  (void)map->Integrate(HouseView({}, 0));
  // Half a pixel off, which the model notices.
  const TrackedMap off = Misplaced(HouseView({}, 4), {0.002, -0.003, 0.002}, {0, 0, 0}, 1);
  const FusionResult second = map->Integrate(off);
  ASSERT_EQ(second.status, FusionStatus::kFused) << second.reason;
  EXPECT_TRUE(second.registration.registered);
  EXPECT_FALSE(second.registration.moved);
  EXPECT_GT(second.registration.tracker_misfit, options.registration.max_misfit);
  EXPECT_EQ(ImageDistance_px(second.S_world_kf.pose(), off.T_world_cam), 0);
  // Far off: refused.
  const FusionResult wrong =
      map->Integrate(Misplaced(HouseView({}, 9), {0.1, 0.15, 0.05}, {2, 1, -2}, 1));
  EXPECT_EQ(wrong.rejection, FusionRejection::kNotRegistered) << wrong.reason;
  // What shows nothing of the model is of one part with it all the same.
  TrackedMap elsewhere = HouseView({}, 0);
  elsewhere.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Vector3d(500, 0, 0));
  const FusionResult apart = map->Integrate(elsewhere);
  EXPECT_EQ(apart.status, FusionStatus::kFused);
  EXPECT_FALSE(apart.starts_submap);
}

// A wall that was never seen, before most of what was: what it hides says nothing, the rest agrees.
TEST(Registration, WhatANewSurfaceHidesSaysNothingWhereNothingMoves) {
  TrackedMap behind_wall = HouseView({}, 4);
  const int shown = behind_wall.depth.cols / 4;  // beside the wall
  behind_wall.depth.colRange(shown, behind_wall.depth.cols).setTo(3);
  SurfelMapOptions options = Registered();
  for (const bool moves : {false, true}) {
    options.registration.moves = moves;
    const auto map = CreateTrackedModel(options);
    (void)map->Integrate(HouseView({}, 0));
    const FusionResult second = map->Integrate(behind_wall);
    // A tracker may have drifted, and the depth map be too near: that is refused.
    EXPECT_EQ(second.status, moves ? FusionStatus::kRejected : FusionStatus::kFused)
        << second.reason;
    if (moves) continue;
    EXPECT_TRUE(second.registration.registered);
    EXPECT_GT(second.registration.agreement, 0.9);
  }
  // With the wall alone in view nothing is left to register with.
  options.registration.moves = false;
  const auto map = CreateTrackedModel(options);
  (void)map->Integrate(HouseView({}, 0));
  behind_wall.depth.setTo(3);
  const FusionResult second = map->Integrate(behind_wall);
  EXPECT_EQ(second.status, FusionStatus::kFused) << second.reason;
  EXPECT_FALSE(second.registration.registered);
}

TEST(Registration, KeepsThePredictionWithoutOverlap) {
  const auto map = CreateTrackedModel(Registered());
  (void)map->Integrate(HouseView({}, 0));
  TrackedMap elsewhere = HouseView({}, 0);
  elsewhere.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Vector3d(500, 0, 0));
  const FusionResult result = map->Integrate(elsewhere);
  EXPECT_EQ(result.status, FusionStatus::kFused);
  EXPECT_FALSE(result.registration.registered);
  EXPECT_TRUE(result.S_world_kf.pose().translation().isApprox(elsewhere.T_world_cam.translation()));
}

}  // namespace
}  // namespace mono3d
