// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/matching.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "tracking/features/feature_grid.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

std::vector<Eigen::Vector2d> RandomPixels(int count, std::mt19937& random) {
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < count; ++i) {
    pixels.emplace_back(Uniform(random, 30, 350), Uniform(random, 30, 190));
  }
  return pixels;
}

PointId PointOf(std::size_t feature) { return {static_cast<std::uint32_t>(feature + 100), 0}; }

// The features of a view, expected `shift` away from where they are.
std::vector<ProjectedPoint> Expect(const View& view, const Eigen::Vector2d& shift) {
  std::vector<ProjectedPoint> projected;
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    projected.push_back({PointOf(i), view.features[i].pixel + shift, 5, 0, 1,
                         view.features[i].descriptor, view.features[i].angle_deg});
  }
  return projected;
}

void Rebuild(View& view) { view.grid = FeatureGrid(view.features, 384, 224); }

TEST(MatchProjected, FindsEachPointWithinItsWindow) {
  std::mt19937 random(SeedFromTestName());
  const View view = MakeView(SmallCamera(), RandomPixels(200, random));
  const auto near = MatchProjected(Expect(view, {4, -4}), view, {});
  ASSERT_EQ(near.size(), 200U);
  for (const PointMatch& match : near) {
    EXPECT_EQ(match.point, PointOf(match.feature));
    EXPECT_EQ(match.distance, 0);
  }
  for (const PointMatch& match : MatchProjected(Expect(view, {6, 0}), view, {})) {
    EXPECT_NE(match.point, PointOf(match.feature));  // out of its window
  }
}

TEST(MatchProjected, GivesAFeatureToItsMostSimilarPoint) {
  View view = MakeView(SmallCamera(), {{100, 100}});
  std::vector<ProjectedPoint> projected = Expect(view, {0, 0});
  projected.push_back(projected[0]);
  projected[0].point = {1};
  projected[0].descriptor[0] ^= 0xff;  // eight bits off
  projected[1].point = {2};
  const auto matches = MatchProjected(projected, view, {});
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].point, PointId{2});
  view.points[0] = PointId{7};
  EXPECT_TRUE(MatchProjected(projected, view, {}).empty());
  EXPECT_EQ(MatchProjected(projected, view, {.take_occupied = true}).size(), 1U);
}

TEST(MatchProjected, AsksForTheBestToBeClearlyBetter) {
  View view = MakeView(SmallCamera(), {{100, 100}, {102, 100}});
  view.features[1].descriptor = view.features[0].descriptor;
  view.features[0].descriptor[0] ^= 0x3ff;  // ten bits off
  view.features[1].descriptor[1] ^= 0x7ff;  // eleven
  std::vector<ProjectedPoint> projected = Expect(view, {0, 0});
  projected.pop_back();
  projected[0].descriptor[0] ^= 0x3ff;
  EXPECT_EQ(MatchProjected(projected, view, {}).size(), 1U);
  EXPECT_TRUE(MatchProjected(projected, view, {.max_ratio = 0.8}).empty());
}

TEST(MatchProjected, DropsPatchesThatTurnedOtherwiseThanTheMost) {
  std::mt19937 random(SeedFromTestName());
  View view = MakeView(SmallCamera(), RandomPixels(100, random));
  std::vector<ProjectedPoint> projected = Expect(view, {0, 0});
  for (std::size_t i = 0; i < 100; ++i) {
    view.features[i].angle_deg = i < 5 ? 30.0 * static_cast<double>(i) + 60 : 354;
  }
  // Most turned by 6 degrees; the first five by anything.
  const auto matches = MatchProjected(projected, view, {});
  EXPECT_EQ(matches.size(), 95U);
  for (const PointMatch& match : matches) EXPECT_GE(match.feature, 5U);
}

TEST(MatchDescriptors, FindsShuffledFeaturesWhoseHalfIsAllowed) {
  std::mt19937 random(SeedFromTestName());
  const View a = MakeView(SmallCamera(), RandomPixels(100, random));
  View b = a;
  std::reverse(b.features.begin(), b.features.end());
  Rebuild(b);
  std::vector<char> first_half(100, 0);
  std::fill(first_half.begin(), first_half.begin() + 50, 1);
  const auto matches = MatchDescriptors(a, first_half, b, std::vector<char>(100, 1));
  ASSERT_EQ(matches.size(), 50U);
  for (const FeatureMatch& match : matches) {
    EXPECT_EQ(match.feature_b, 99 - match.feature_a);
    EXPECT_LT(match.feature_a, 50U);
  }
}

TEST(MatchNearby, LooksWithinTheRadiusAndTheLevels) {
  std::mt19937 random(SeedFromTestName());
  const View a = MakeView(SmallCamera(), RandomPixels(100, random));
  View b = a;
  for (Feature& feature : b.features) feature.pixel.x() += 20;
  for (std::size_t i = 0; i < 40; ++i) b.features[i].level = 2;
  Rebuild(b);
  EXPECT_EQ(MatchNearby(a, b, {25, 3}).size(), 60U);  // the first forty jumped by two levels
  EXPECT_TRUE(MatchNearby(a, b, {15, 3}).empty());
  EXPECT_EQ(MatchNearby(a, b, {15, 3, {10, 0}}).size(), 60U);
}

TEST(ProjectMapPoint, PredictsPixelAndLevelOrSaysNo) {
  Map map(0, SmallCamera(), FeatureOptions{});
  View view = MakeView(SmallCamera(), {{191.5, 111.5}});
  map.AddKeyframe(view);
  view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.1, 0, 0));
  map.AddKeyframe(view);
  const PointId point = map.AddPoint({0, 0, 4});
  map.AddObservation(point, {0, 0});
  map.AddObservation(point, {1, 0});
  map.UpdatePoint(point);

  view.T_cam_world = Pose();
  const auto here = ProjectMapPoint(map, point, view);
  ASSERT_TRUE(here.has_value());
  EXPECT_EQ(here->pixel, Eigen::Vector2d(191.5, 111.5));
  EXPECT_LE(here->max_level, 1);
  // Half the distance: twice the size, four levels up (1.2^4 = 2.07).
  view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -2));
  const auto closer = ProjectMapPoint(map, point, view);
  ASSERT_TRUE(closer.has_value());
  EXPECT_EQ(closer->max_level, 4);

  const auto seen_from = [&](const Pose& T_cam_world) {
    view.T_cam_world = T_cam_world;
    return ProjectMapPoint(map, point, view).has_value();
  };
  const Eigen::Quaterniond ahead = Eigen::Quaterniond::Identity();
  EXPECT_FALSE(seen_from({ahead, Eigen::Vector3d(0, 0, -5)}));  // behind the camera
  EXPECT_FALSE(seen_from({ahead, Eigen::Vector3d(0, 0, 4)}));   // too far
  EXPECT_FALSE(seen_from({ahead, Eigen::Vector3d(10, 0, 0)}));  // outside the image
  const Pose from_the_side(RotationExp({0, 1.3, 0}), Eigen::Vector3d(-3.85, 0, 2.9));
  EXPECT_GT((from_the_side * Eigen::Vector3d(0, 0, 4)).z(), 3);  // in view, but 75 degrees round
  EXPECT_FALSE(seen_from(from_the_side));
}

}  // namespace
}  // namespace mono3d::tracking
