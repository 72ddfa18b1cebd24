// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>
#include <vector>

#include "fusion/registration/constraint.h"
#include "fusion/registration_scene.h"
#include "fusion/surfel.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

TEST(AnchorToTellOf, IsTheOldestThatIsMuchOfWhatIsInView) {
  std::vector<std::uint32_t> anchors = {0};  // per block
  anchors.insert(anchors.end(), 3, 1);
  anchors.insert(anchors.end(), 16, 2);
  std::vector<std::uint32_t> blocks(anchors.size());
  std::iota(blocks.begin(), blocks.end(), 0U);
  EXPECT_EQ(AnchorToTellOf(blocks, anchors), 1U) << "a twentieth is of 0, three of 1";
  EXPECT_EQ(AnchorToTellOf(std::vector<std::uint32_t>{0, 19}, anchors), 0U);
  EXPECT_EQ(AnchorToTellOf({}, anchors), std::nullopt);
}

TEST(AnchorToTellOf, IsThatOfMostBlocksWhereAllAreFew) {
  std::vector<std::uint32_t> anchors(40), blocks(40);
  std::iota(blocks.begin(), blocks.end(), 0U);
  for (std::uint32_t i = 0; i < 40; ++i) anchors[i] = i / 2;
  anchors[39] = 7;
  EXPECT_EQ(AnchorToTellOf(blocks, anchors), 7U);
}

TEST(InformationOf, CountsWhatIsIndependentAndWhatIsCommon) {
  RegistrationSystem system;
  system.information = 1000 * Matrix7d::Identity();
  system.num_agree = 300;
  system.num_grey = 100;
  system.depth_cost = 150;
  system.grey_cost = 50;  // together half of what is expected, which makes nothing surer
  RegistrationOptions options;
  options.max_misfit = 0;
  // One residual in nine of a 63rd each: a seventh of them is independent.
  EXPECT_NEAR(InformationOf(system, 9, options)(2, 2), 1000.0 / 7, 1e-9);
  EXPECT_NEAR(InformationOf(system, 100, options)(2, 2), 1000, 1e-9);
  options.max_misfit = 0.25;  // 400 of a 16th besides
  EXPECT_NEAR(InformationOf(system, 9, options)(2, 2), 1000.0 / (7 + 25), 1e-9);
  system.depth_cost = 750;  // twice what is expected
  EXPECT_NEAR(InformationOf(system, 9, options)(2, 2), 1000.0 / (7 + 25) / 2, 1e-9);
  options.with_scale = false;
  EXPECT_EQ(InformationOf(system, 9, options)(6, 6), 0);
  EXPECT_EQ(InformationOf({}, 9, options), Matrix7d::Zero());
}

TEST(MakeConstraint, IsInTheOwnUnitsOfTheKeyframes) {
  Anchor anchor, of_kf;
  anchor.keyframe_id = 3;
  of_kf.keyframe_id = 8;
  // Its own unit is two of the world.
  const Similarity S_world_anchor(2, Pose(Eigen::Quaterniond::Identity(), Vector3d(4, 0, 0)));
  const Similarity S_world_kf(6, Pose(Eigen::Quaterniond::Identity(), Vector3d(10, 0, 0)));
  const KeyframeConstraint constraint =
      MakeConstraint({of_kf, S_world_kf}, Matrix7d::Identity(), {anchor, S_world_anchor});
  EXPECT_EQ(constraint.id, 8);
  EXPECT_EQ(constraint.anchor_id, 3);
  // Six of the world's units to the left, three of the anchor's.
  EXPECT_LT((constraint.T_cam_anchor.translation() - Vector3d(-3, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(constraint.scale, 3);  // six of the world's units are three of the anchor's
  EXPECT_EQ(constraint.information(0, 0), 1);
  // One sigma of one unit of the keyframe is one of three of the anchor's.
  EXPECT_NEAR(constraint.information(3, 3), 1.0 / 9, 1e-12);
}

// Depths that have changed with the poses are no longer in the own unit of their keyframe.
TEST(MakeConstraint, IsNotInTheUnitOfDepthsThatHaveChanged) {
  const auto anchor_of = [](std::int64_t id, double depth_scale) {
    DepthMap map;
    map.camera = HouseCamera();
    map.views = {{100, Pose(Eigen::Quaterniond::Identity(), Vector3d(1, 0, 0))}};
    Anchor anchor;
    anchor.keyframe_id = id;
    anchor.depth_scale = DepthScale(map, 10);
    const Pose view(Eigen::Quaterniond::Identity(), Vector3d(depth_scale, 0, 0));
    const KeyframePoses poses(1, {{id, 0, {}}, {100, 0, {1, view}}});
    anchor.S_tracker_kf = TrackedPose(poses, 0, anchor).value();
    return anchor;
  };
  const Anchor oldest = anchor_of(3, 2);  // two of its own units
  const Anchor of_kf = anchor_of(8, 1.5);
  ASSERT_NEAR(oldest.S_tracker_kf.scale(), 2, 1e-9);
  const auto at = [](double scale, double x) {
    return Similarity(scale, Pose(Eigen::Quaterniond::Identity(), Vector3d(x, 0, 0)));
  };
  // Where the tracker has both: own units of the world's length.
  const Similarity S_world_anchor = at(2, 4), S_world_kf = at(1.5, 10);
  const KeyframeConstraint constraint =
      MakeConstraint({of_kf, S_world_kf}, Matrix7d::Identity(), {oldest, S_world_anchor});
  EXPECT_LT((constraint.T_cam_anchor.translation() - Vector3d(-6, 0, 0)).norm(), 1e-9);
  EXPECT_NEAR(constraint.scale, 1, 1e-9);
  // One sigma is one unit of the depth map.
  EXPECT_NEAR(constraint.information(3, 3), 1 / (1.5 * 1.5), 1e-9);
}

// What a model says that knows better: the true pose, as exactly as it says that it is.
class ModelAgainstTracker : public testing::TestWithParam<double> {};

TEST_P(ModelAgainstTracker, TellsWhereTheKeyframeIs) {
  HouseScene scene;
  scene.world_scale = GetParam();
  const auto map = CreateTrackedModel({});
  TrackedMap first = HouseView(scene, 0);
  first.keyframe_id = 20;
  EXPECT_TRUE(map->Integrate(first).constraints.empty());
  TrackedMap second = HouseView(scene, 3);
  second.keyframe_id = 21;
  EXPECT_TRUE(map->Integrate(second).constraints.empty());  // the tracker is right
  const TrackedMap truth = HouseView(scene, 5);
  TrackedMap third = Misplaced(truth, Vector3d(0.02, -0.03, 0.02),
                               scene.world_scale * Vector3d(0.3, -0.2, 0.2), 1.02);
  third.keyframe_id = 22;
  const FusionResult result = map->Integrate(third);
  ASSERT_EQ(result.status, FusionStatus::kFused) << result.reason;
  ASSERT_EQ(result.constraints.size(), 1U);
  const KeyframeConstraint& constraint = result.constraints.front();
  EXPECT_EQ(constraint.id, 22);
  EXPECT_EQ(constraint.anchor_id, 20);  // most of the model came from there
  const Pose error =
      constraint.T_cam_anchor * (truth.T_world_cam.Inverse() * first.T_world_cam).Inverse();
  Vector7d difference;
  difference << RotationLog(error.rotation()), error.translation(),
      std::log(constraint.scale / 1.02);
  const double chi2 = difference.dot(constraint.information * difference);
  constexpr double kChi2SevenDof = 24.3;  // at 99.9 %
  EXPECT_LT(chi2, kChi2SevenDof);
  // And that is exact enough to be of use: a tracker that was right would contradict it.
  const Pose misplaced =
      third.T_world_cam.Inverse() * first.T_world_cam * constraint.T_cam_anchor.Inverse();
  difference << RotationLog(misplaced.rotation()), misplaced.translation(), 0.02;
  EXPECT_GT(difference.dot(constraint.information * difference), kChi2SevenDof);
}

INSTANTIATE_TEST_SUITE_P(AtAnyScaleOfTheWorld, ModelAgainstTracker, testing::Values(1.0, 30.0));

}  // namespace
}  // namespace mono3d
