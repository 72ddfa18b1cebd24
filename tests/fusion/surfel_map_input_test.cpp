// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

using ::testing::HasSubstr;

TrackedMap SmallMap() { return PlaneMap(TestCamera(16, 12), Pose()); }

void ExpectRejectedUntouched(TrackedModel& map, const TrackedMap& depth_map,
                             FusionRejection rejection, const std::string& reason) {
  const PointCloud before = map.Export(1);
  const FusionResult result = map.Integrate(depth_map);
  EXPECT_EQ(result.status, FusionStatus::kRejected);
  EXPECT_EQ(result.rejection, rejection);
  EXPECT_THAT(result.reason, HasSubstr(reason));
  EXPECT_EQ(result.num_merged + result.num_inserted + result.num_removed, 0);
  EXPECT_EQ(result.num_surfels, map.num_surfels());
  const PointCloud after = map.Export(1);
  EXPECT_EQ(after.points, before.points);
  EXPECT_EQ(after.observations, before.observations);
}

TEST(SurfelMapInput, RejectsAnEmptyDepthMap) {
  const auto map = CreateTrackedModel();
  TrackedMap empty = SmallMap();
  empty.depth.setTo(0);
  ExpectRejectedUntouched(*map, empty, FusionRejection::kNoEstimate, "no estimate");
  (void)map->Integrate(SmallMap());
  ExpectRejectedUntouched(*map, empty, FusionRejection::kNoEstimate, "no estimate");
  TrackedMap without_confidence = SmallMap();
  without_confidence.confidence = cv::Mat(12, 16, CV_32FC1, cv::Scalar(0));
  ExpectRejectedUntouched(*map, without_confidence, FusionRejection::kNoEstimate, "no estimate");
}

TEST(SurfelMapInput, MakesNoSurfelsOfAnUncertainBorder) {
  TrackedMap depth_map = SmallMap();
  depth_map.uncertain_border_px = 2;
  const auto map = CreateTrackedModel();
  EXPECT_EQ(map->Integrate(depth_map).num_inserted, 12 * 8);  // of 16 x 12 pixels
  depth_map.uncertain_border_px = 6;
  ExpectRejectedUntouched(*map, depth_map, FusionRejection::kNoEstimate, "no estimate");
}

TEST(SurfelMapInput, AGrazingViewCountsLess) {
  TrackedMap depth_map = SmallMap();
  const double angle_rad = 80 * std::numbers::pi / 180;
  const cv::Vec3f normal(0, static_cast<float>(std::sin(angle_rad)),
                         static_cast<float>(-std::cos(angle_rad)));
  depth_map.normal = cv::Mat(12, 16, CV_32FC3, cv::Scalar(normal[0], normal[1], normal[2]));
  depth_map.confidence = cv::Mat(12, 16, CV_32FC1, cv::Scalar(0.5));
  const auto map = CreateTrackedModel();
  (void)map->Integrate(depth_map);
  const PointCloud model = map->Export(1);
  ASSERT_EQ(model.size(), 16U * 12U);
  const double least_cosine = std::cos(75 * std::numbers::pi / 180);
  const double kStep = 1.0 / 256;  // of the sum of confidences
  for (int y = 0; y < 12; ++y) {
    const Eigen::Vector3d ray = depth_map.camera.Unproject({8, y}).normalized();
    const double share = -ray.dot(Eigen::Vector3d(normal[0], normal[1], normal[2])) / least_cosine;
    const double sum = 0.5 * (share < 1 && share > 0 ? share * share : 1);
    const double confidence = model.confidences[static_cast<std::size_t>(y * 16 + 8)];
    EXPECT_NEAR(confidence / (1 - confidence), sum, kStep) << "row " << y;
  }
}

TEST(SurfelMapInput, CountsEstimatesAlikeWithoutConfidence) {
  TrackedMap depth_map = SmallMap();
  depth_map.confidence = cv::Mat(12, 16, CV_32FC1, cv::Scalar(0.25));
  for (const bool with_confidence : {true, false}) {
    SurfelMapOptions options;
    options.with_confidence = with_confidence;
    const auto map = CreateTrackedModel(options);
    (void)map->Integrate(depth_map);
    // s / (s + 1) of a single observation.
    EXPECT_FLOAT_EQ(map->Export(1).confidences.front(), with_confidence ? 0.2F : 0.5F);
  }
}

TEST(SurfelMapInput, RejectsADepthMapOfAnotherMap) {
  const auto map = CreateTrackedModel();
  TrackedMap first = SmallMap();
  first.map_id = 4;
  EXPECT_EQ(map->Integrate(first).status, FusionStatus::kFused);
  TrackedMap other = SmallMap();
  other.map_id = 5;
  ExpectRejectedUntouched(*map, other, FusionRejection::kOtherMap, "map 5");
}

TEST(SurfelMapInput, RejectsWhatDoesNotFit) {
  SurfelMapOptions options;
  options.max_surfels = 16 * 12 + 10;
  const auto map = CreateTrackedModel(options);
  EXPECT_EQ(map->Integrate(SmallMap()).status, FusionStatus::kFused);
  // The same place again needs no room; a picture of more pixels than the model may hold does,
  // even when it is made eight times coarser.
  EXPECT_EQ(map->Integrate(SmallMap()).status, FusionStatus::kFused);
  TrackedMap elsewhere = PlaneMap(TestCamera(160, 120), Pose());
  elsewhere.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(100, 0, 0));
  const FusionResult result = map->Integrate(elsewhere);
  EXPECT_EQ(result.status, FusionStatus::kRejected);
  EXPECT_EQ(result.rejection, FusionRejection::kModelFull);
  EXPECT_THAT(result.reason, ::testing::HasSubstr("model is full"));
}

TEST(SurfelMapInput, FusesMapsOfDifferentSizes) {
  const auto map = CreateTrackedModel();
  EXPECT_EQ(map->Integrate(SmallMap()).status, FusionStatus::kFused);
  // Half the resolution sees every surfel and adds none.
  const FusionResult coarser = map->Integrate(PlaneMap(TestCamera(8, 6), Pose()));
  EXPECT_EQ(coarser.num_merged, 8 * 6);
  EXPECT_EQ(map->Export(2).size(), 16U * 12U);
  // Four times the resolution adds detail.
  EXPECT_GT(map->Integrate(PlaneMap(TestCamera(64, 48), Pose())).num_inserted, 0);
}

TEST(SurfelMapInput, ThrowsOnAnInvalidDepthMap) {
  const auto map = CreateTrackedModel();
  TrackedMap wrong_size = SmallMap();
  wrong_size.depth = cv::Mat(3, 3, CV_32FC1, cv::Scalar(1));
  EXPECT_THROW((void)map->Integrate(wrong_size), Error);
  TrackedMap distorted = SmallMap();
  distorted.camera.distortion[0] = 0.1;
  EXPECT_THROW((void)map->Integrate(distorted), Error);
  DepthMap no_pose = SmallMap();
  no_pose.keyframe_id = 77;
  EXPECT_THROW((void)map->model().Integrate(no_pose, map->Poses()), Error);
  EXPECT_EQ(map->num_surfels(), 0);
}

TEST(SurfelMapInput, RefusesOptionsOutOfRange) {
  SurfelMapOptions options;
  options.max_surfels = -1;
  EXPECT_THROW(CreateTrackedModel(options), UsageError);
}

TEST(SurfelMapInput, TakesNotANumberForNoEstimate) {
  const auto map = CreateTrackedModel();
  TrackedMap depth_map = SmallMap();
  depth_map.depth.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
  depth_map.depth.at<float>(0, 1) = std::numeric_limits<float>::infinity();
  depth_map.depth.at<float>(0, 2) = -1;
  EXPECT_EQ(map->Integrate(depth_map).num_inserted, 16 * 12 - 3);
  for (const auto& p : map->Export(1).points) EXPECT_TRUE(p.allFinite());
}

TEST(SurfelMapInput, ReportsTimesOfItsStages) {
  StageTimes times;
  const auto map = CreateTrackedModel({}, &times);
  (void)map->Integrate(SmallMap());
  (void)map->Integrate(SmallMap());
  std::vector<std::string> stages;
  for (const StageTime& time : times.Snapshot()) stages.push_back(time.stage);
  for (const char* stage : {"fusion/integrate", "fusion/prepare", "fusion/merge",
                            "fusion/select_new", "fusion/insert"}) {
    EXPECT_THAT(stages, ::testing::Contains(stage));
  }
  // With or without the index map in one pass.
  EXPECT_THAT(stages, ::testing::Contains(::testing::StartsWith("fusion/associate")));
}

}  // namespace
}  // namespace mono3d
