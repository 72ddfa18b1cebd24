// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

// Maps of noise in random colours: there is nothing to register.
SurfelMapOptions Unregistered() {
  SurfelMapOptions options;
  options.registration.enabled = false;
  return options;
}

constexpr int kWidth = 96;
constexpr int kHeight = 64;
const cv::Rect kFalsePatch(30, 20, 20, 10);

// A wall 10 su away, of which a patch is at another depth, with less confidence.
TrackedMap WallMap(unsigned seed, float patch_depth = 10) {
  TrackedMap map = PlaneMap(TestCamera(kWidth, kHeight), Pose());
  map.depth(kFalsePatch).setTo(patch_depth);
  Disturb(map, 0.001, 0, seed);
  map.confidence = cv::Mat(kHeight, kWidth, CV_32FC1, cv::Scalar(0.75));
  if (patch_depth != 10) map.confidence(kFalsePatch).setTo(0.5);
  return map;
}

std::size_t CountOffTheWall(const PointCloud& cloud) {
  std::size_t count = 0;
  for (const auto& p : cloud.points) count += std::abs(p.z() - 10) > 1 ? 1 : 0;
  return count;
}

class SurfelReview : public ::testing::TestWithParam<float> {};

TEST_P(SurfelReview, DoubtsWhatEarlierMapsSpeakAgainst) {
  const auto map = CreateTrackedModel(Unregistered());
  (void)map->Integrate(WallMap(1));
  (void)map->Integrate(WallMap(2));
  const FusionResult result = map->Integrate(WallMap(3, GetParam()));
  EXPECT_EQ(result.num_inserted, kFalsePatch.area());
  EXPECT_EQ(result.num_removed, 0);
  EXPECT_EQ(CountOffTheWall(map->Export(SurfelExportOptions{})), 0U);
  EXPECT_EQ(map->Integrate(WallMap(4)).num_removed, kFalsePatch.area());
  EXPECT_EQ(CountOffTheWall(map->Export(1)), 0U);
}

TEST_P(SurfelReview, RemovesWhatALaterMapSpeaksAgainst) {
  const auto map = CreateTrackedModel(Unregistered());
  (void)map->Integrate(WallMap(1, GetParam()));
  (void)map->Integrate(WallMap(2));
  EXPECT_EQ(CountOffTheWall(map->Export(1)), 0U);
}

TEST_P(SurfelReview, KeepsWhatIsThereWhenOneMapIsWrong) {
  const auto map = CreateTrackedModel(Unregistered());
  for (unsigned seed = 1; seed <= 3; ++seed) (void)map->Integrate(WallMap(seed));
  (void)map->Integrate(WallMap(4, GetParam()));
  EXPECT_EQ(map->Export(3).size() - CountOffTheWall(map->Export(3)),
            static_cast<std::size_t>(kWidth * kHeight));
}

INSTANTIATE_TEST_SUITE_P(BeforeAndBehindTheWall, SurfelReview, ::testing::Values(4.0F, 40.0F));

TEST(SurfelReview, IsLeftOutWhenAskedFor) {
  SurfelMapOptions options = Unregistered();
  options.num_reviews = 0;
  const auto map = CreateTrackedModel(options);
  (void)map->Integrate(WallMap(1));
  (void)map->Integrate(WallMap(2));
  EXPECT_EQ(map->Integrate(WallMap(3, 40)).num_removed, 0);
  EXPECT_EQ(CountOffTheWall(map->Export(SurfelExportOptions{})), 200U);
}

// A house hides what is behind it from some maps: what several have seen stays.
TEST(SurfelReview, KeepsAHiddenSurfaceThatSeveralMapsHaveSeen) {
  const auto map = CreateTrackedModel(Unregistered());
  (void)map->Integrate(WallMap(1));
  (void)map->Integrate(WallMap(2));
  TrackedMap past_a_house = WallMap(3);
  past_a_house.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -20));
  past_a_house.depth.setTo(15);  // behind the first two cameras
  for (int i = 0; i < 4; ++i) (void)map->Integrate(past_a_house);
  EXPECT_EQ(map->Export(1).size(), 2U * kWidth * kHeight);
}

}  // namespace
}  // namespace mono3d
