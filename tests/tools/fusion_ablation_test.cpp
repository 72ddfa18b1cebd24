// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The ablation of fusion, on two made-up depth maps of a wall.

#include "bench/fusion_ablation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <set>
#include <utility>
#include <vector>

#include "bench/recorded_fusion.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

constexpr double kFigureRounding = 1e-9;

constexpr int kNumKeyframes = 300;

KeyframePoses PosesWith(std::int64_t keyframe, double x_su) {
  std::vector<KeyframePose> poses(kNumKeyframes);
  for (int i = 0; i < kNumKeyframes; ++i) poses[static_cast<std::size_t>(i)].keyframe_id = i;
  poses[static_cast<std::size_t>(keyframe)].S_world_kf =
      Similarity(1, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_su, 0, 0)));
  return {1, std::move(poses)};
}

// Its keyframe is at x, all others at 0.
FusionEvent WallMap(std::int64_t keyframe, double x_su) {
  DepthMap map;
  map.camera.width = 48;
  map.camera.height = 32;
  map.camera.fx = map.camera.fy = 40;
  map.camera.cx = 23.5;
  map.camera.cy = 15.5;
  map.depth = cv::Mat(32, 48, CV_32FC1, cv::Scalar(10));
  map.keyframe_id = map.frame_index = keyframe;
  map.timestamp_s = static_cast<double>(keyframe);
  map.depth_sigma_per_square_depth = 0.01;
  return {PosesWith(keyframe, x_su), map};
}

TEST(FusionVariants, AreValidAndNoTwoHaveOneName) {
  std::set<std::string> names;
  for (const FusionVariant& variant : FusionVariants({})) {
    EXPECT_NO_THROW(variant.fusion.Validate()) << variant.name;
    EXPECT_TRUE(names.insert(variant.name).second) << variant.name;
  }
  EXPECT_FALSE(FusionVariants({}).front().has_pose_errors);
}

TEST(FusionFigures, AreMeansButForTheCounts) {
  FusionFigures one, other;
  one.num_maps = 3, one.num_fused = 2, one.model_rmse = 0.001, one.f_score = 0.9;
  other.num_maps = 5, other.num_fused = 5, other.model_rmse = 0.003, other.f_score = 1.0;
  const FusionFigures mean = MeanFigures({one, other});
  EXPECT_EQ(mean.num_maps, 8);
  EXPECT_EQ(mean.num_fused, 7);
  EXPECT_NEAR(mean.model_rmse, 0.002, kFigureRounding);
  EXPECT_NEAR(mean.f_score, 0.95, kFigureRounding);
}

TEST(RecordedFusion, PoseErrorsAreOfTheSizeAskedForAndAlwaysTheSame) {
  std::vector<FusionEvent> events;
  for (int i = 0; i < kNumKeyframes; ++i) events.push_back(WallMap(i, 0));
  events.push_back({PosesWith(0, 0), {}});
  const std::vector<FusionEvent> worse = WithPoseErrors(events, 0.005);
  double squares = 0;
  for (int i = 0; i < kNumKeyframes; ++i) {
    const Pose& pose = worse[static_cast<std::size_t>(i)].poses.At(i).T_world_cam();
    squares += pose.translation().squaredNorm();
    EXPECT_TRUE(pose.rotation().isApprox(Eigen::Quaterniond::Identity()));
  }
  // 0.5 % of 10 su; the mean of 900 squares scatters by 5 %, its root by half of that.
  EXPECT_NEAR(std::sqrt(squares / kNumKeyframes), 0.05, 0.05 * 0.1);
  EXPECT_EQ(worse.back().poses.At(7).T_world_cam().translation(),
            worse[7].poses.At(7).T_world_cam().translation())
      << "a keyframe is off alike whenever it is told of";
}

TEST(RecordedFusion, IsFusedAgainWithItsPoses) {
  std::vector<FusionEvent> events = {WallMap(0, 0), WallMap(1, 0.5)};
  events.push_back({PosesWith(1, 0.75), {}});
  const auto device = OpenDevice();
  const auto model = CreateSurfelMap(device);
  const FusedRun run = FuseAgain(events, *model, {});
  EXPECT_EQ(run.num_maps, 2);
  EXPECT_EQ(run.num_fused, 2);
  ASSERT_EQ(run.poses.size(), 2U);
  EXPECT_NEAR(run.poses[1].T_world_cam.translation().x(), 0.75, 1e-6);
  EXPECT_GE(run.model.size(), 48U * 32U);
}

}  // namespace
}  // namespace mono3d::tools
