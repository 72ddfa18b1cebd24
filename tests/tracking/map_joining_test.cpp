// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/map_joining.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tracking/places/place_matching.h"
#include "tracking/places/relocaliser.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr double kJoinTolerance = 1e-12;

// Two keyframes at x = 0 and x = 1 that see one point 10 ahead of them, and a culled one between.
Map SmallMap(int id) {
  Map map(id, SmallCamera(), FeatureOptions{});
  for (const double x : {0.0, 0.5, 1.0}) {
    View view = MakeView(SmallCamera(), {{191.5, 111.5}, {20, 20}});
    view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
    map.AddKeyframe(std::move(view));
  }
  const PointId point = map.AddPoint({0, 0, 10});
  for (const KeyframeId keyframe : {0, 1, 2}) map.AddObservation(point, {keyframe, 0});
  map.UpdatePoint(point);
  map.RemoveKeyframe(1, 0);
  return map;
}

// A quarter turn about z, twice as large, moved.
const Similarity& Turn() {
  static const Similarity S(
      2, Pose(RotationExp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(100, 0, 0)));
  return S;
}

TEST(Append, NumbersAndMovesWhatTheOtherMapHolds) {
  Map map = SmallMap(0);
  Map other = SmallMap(1);
  const MapPoint before = other.point(PointId{0});
  map.Append(std::move(other), Turn());
  EXPECT_TRUE(other.keyframes().empty());  // NOLINT(bugprone-use-after-move): as documented
  ASSERT_EQ(map.keyframes().size(), 6U);
  ASSERT_EQ(map.points().size(), 2U);
  // Worked by hand: x = 1 becomes y = 2, then x + 100.
  EXPECT_LT((map.keyframe(5).view.Centre() - Eigen::Vector3d(100, 2, 0)).norm(), kJoinTolerance);
  EXPECT_LT((map.T_cam_world(4).Inverse().translation() - Eigen::Vector3d(100, 1, 0)).norm(),
            kJoinTolerance);  // the culled one, by its anchor
  EXPECT_LT((map.point(PointId{1}).p_world - Eigen::Vector3d(100, 0, 20)).norm(), kJoinTolerance);
  EXPECT_EQ(map.keyframe(5).view.points[0], PointId{1});
  ASSERT_EQ(map.point(PointId{1}).observations.size(), 2U);
  EXPECT_EQ(map.point(PointId{1}).observations[0].keyframe, 3U);
  EXPECT_EQ(map.keyframe(4).anchor, 3U);
  EXPECT_DOUBLE_EQ(map.keyframe(3).scale, 2);
  EXPECT_DOUBLE_EQ(map.keyframe(0).scale, 1);
  EXPECT_DOUBLE_EQ(map.point(PointId{1}).max_distance, 2 * before.max_distance);
}

TEST(Append, LeavesEveryImageAsItWas) {
  Map map = SmallMap(0);
  map.Append(SmallMap(1), Turn());
  for (const KeyframeId keyframe : {3, 5}) {
    const Eigen::Vector3d p_cam = map.T_cam_world(keyframe) * map.point(PointId{1}).p_world;
    const Eigen::Vector3d expected =
        2 * (SmallMap(1).T_cam_world(keyframe - 3) * SmallMap(1).point(PointId{0}).p_world);
    EXPECT_LT((p_cam - expected).norm(), kJoinTolerance);
  }
}

// 18 of 25 features are where the points of the old map would show, the others 4 px beside: enough
// for a rough pose, too few for a fine one.
TEST(MatchPlace, IsNoneWhereTheFinePoseHasTooFewPoints) {
  Map old_map(0, SmallCamera(), FeatureOptions{});
  Map own_map(1, SmallCamera(), FeatureOptions{});
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 25; ++i) pixels.emplace_back(40 + 70 * (i % 5), 30 + 40 * (i / 5));
  old_map.AddKeyframe(MakeView(SmallCamera(), pixels));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double depth = 8 + static_cast<double>(i * 7 % 5);
    const PointId point = old_map.AddPoint(depth * SmallCamera().Unproject(pixels[i]));
    old_map.AddObservation(point, {0, i});
  }
  for (std::size_t i = 18; i < pixels.size(); ++i) {
    const auto angle = static_cast<double>(2 * i);
    pixels[i] += 4 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  own_map.AddKeyframe(MakeView(SmallCamera(), pixels));
  // Numbers that the old map does not have.
  for (int i = 0; i < 10000; ++i) own_map.AddPoint({0, 0, 1});
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    own_map.AddObservation(own_map.AddPoint(10 * SmallCamera().Unproject(pixels[i])), {0, i});
  }
  View view = own_map.keyframe(0).view;
  const int num_inliers = FindPoseByKeyframe(old_map, 0, view, 1).num_inliers;
  ASSERT_GE(num_inliers, kMinVotes);
  ASSERT_LT(num_inliers, 20);
  // A proposal that the view has taken over, in place of its 25 own points.
  const auto num_points = std::count_if(view.points.begin(), view.points.end(),
                                        [](const auto& point) { return point.has_value(); });
  EXPECT_EQ(num_points, num_inliers);
  EXPECT_FALSE(MatchPlace(own_map, 0, old_map, 0, 1).has_value());
}

TEST(SimilarityOf, TakesTheKeyframeToWhereTheOtherMapHasIt) {
  const Map map = SmallMap(1);
  PlaceFound place;
  place.keyframe = 2;
  place.scale = 2;
  place.T_cam_world = (Turn() * map.T_cam_world(2).Inverse()).Inverse();
  const Similarity S = SimilarityOf(place, map);
  EXPECT_NEAR(S.scale(), 2, kJoinTolerance);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 10), Eigen::Vector3d(-3, 4, 5)}) {
    EXPECT_LT((S * p - Turn() * p).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace mono3d::tracking
