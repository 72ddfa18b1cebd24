// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/map.h"

#include <gtest/gtest.h>

#include <span>
#include <utility>
#include <vector>

#include "tracking/map/map_checks.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

// Three keyframes at x = 0, 1, 2 with four features each and no points yet.
Map ThreeKeyframes() {
  Map map(0, SmallCamera(), FeatureOptions{});
  for (int i = 0; i < 3; ++i) {
    View view = MakeView(SmallCamera(), {{50, 50}, {100, 50}, {50, 100}, {100, 100}});
    view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-i, 0, 0));
    map.AddKeyframe(std::move(view));
  }
  return map;
}

// A point at depth 4 that each of the keyframes sees with the same feature.
PointId AddSeen(Map& map, std::size_t feature, std::initializer_list<KeyframeId> keyframes) {
  const PointId point = map.AddPoint({0, 0, 4});
  for (const KeyframeId keyframe : keyframes) map.AddObservation(point, {keyframe, feature});
  map.UpdatePoint(point);
  return point;
}

TEST(Map, KeepsBothSidesOfAnObservation) {
  Map map = ThreeKeyframes();
  const PointId point = AddSeen(map, 1, {2, 0});
  EXPECT_EQ(map.keyframe(0).view.points[1], point);
  EXPECT_EQ(map.FeatureOf(point, 2), 1U);
  EXPECT_FALSE(map.FeatureOf(point, 1).has_value());
  EXPECT_EQ(map.point(point).observations.front().keyframe, 0U);  // ascending
}

TEST(Map, DropsAPointWithOneObservationLeft) {
  Map map = ThreeKeyframes();
  const PointId point = AddSeen(map, 0, {0, 1, 2});
  map.RemoveObservation(point, {1, 0});
  EXPECT_TRUE(map.IsAlive(point));
  map.RemoveObservation(point, {0, 0});
  EXPECT_FALSE(map.IsAlive(point));
  EXPECT_FALSE(map.keyframe(2).view.points[0].has_value());
}

TEST(Map, TellsANewPointFromTheRemovedOneInItsPlace) {
  Map map = ThreeKeyframes();
  const PointId kept = AddSeen(map, 0, {0, 1});
  const PointId gone = AddSeen(map, 1, {0, 1});
  map.RemovePoint(gone);
  map.RemovePoint(gone);  // is not there any more
  EXPECT_FALSE(map.IsAlive(gone));
  const PointId reused = AddSeen(map, 2, {0, 1});
  EXPECT_EQ(reused.index, gone.index);
  EXPECT_NE(reused, gone);
  EXPECT_FALSE(map.IsAlive(gone));
  EXPECT_TRUE(map.IsAlive(reused));
  EXPECT_EQ(map.point(reused).observations.size(), 2U);
  map.RemovePoint(gone);  // is another one by now
  EXPECT_TRUE(map.IsAlive(reused));
  EXPECT_NE(AddSeen(map, 3, {0, 1}).index, gone.index);  // a place is given away once
  EXPECT_EQ(map.PointIds().size(), 3U);
  EXPECT_EQ(map.PointIds()[0], kept);
  EXPECT_EQ(map.PointIds()[1], reused);
  // Who still holds the old one counts it for nothing.
  EXPECT_EQ(map.KeyframesSeeing({kept, reused}).size(), 2U);
  EXPECT_TRUE(map.KeyframesSeeing({gone}).empty());
}

TEST(Map, MergesTheObservationsOfTwoPoints) {
  Map map = ThreeKeyframes();
  const PointId kept = AddSeen(map, 0, {0, 1});
  const PointId gone = AddSeen(map, 3, {1, 2});
  map.MergePoints(gone, kept);
  EXPECT_FALSE(map.IsAlive(gone));
  EXPECT_EQ(map.point(kept).observations.size(), 3U);
  EXPECT_EQ(map.FeatureOf(kept, 1), 0U);  // it had one there already
  EXPECT_EQ(map.FeatureOf(kept, 2), 3U);
  EXPECT_FALSE(map.keyframe(1).view.points[3].has_value());
}

TEST(Map, CountsCovisibleKeyframes) {
  Map map = ThreeKeyframes();
  AddSeen(map, 0, {0, 1});
  AddSeen(map, 1, {0, 1, 2});
  const std::vector<Covisible> covisible = map.CovisibleKeyframes(0);
  ASSERT_EQ(covisible.size(), 2U);
  EXPECT_EQ(covisible[0].keyframe, 1U);
  EXPECT_EQ(covisible[0].num_shared, 2);
  EXPECT_EQ(covisible[1].num_shared, 1);
}

TEST(Map, FindsACulledKeyframeByItsAnchor) {
  Map map = ThreeKeyframes();
  AddSeen(map, 0, {0, 1, 2});
  map.RemoveKeyframe(1, 0);
  EXPECT_TRUE(map.CovisibleKeyframes(0).size() == 1);
  EXPECT_EQ(map.T_cam_world(1).translation(), Eigen::Vector3d(-1, 0, 0));
  // It moves with the anchor.
  map.keyframe(0).view.T_cam_world = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 5));
  EXPECT_EQ(map.T_cam_world(1).translation(), Eigen::Vector3d(-1, 0, 5));
}

// As no tracker makes it, but a file may have it: each culled keyframe is fixed to the one before.
TEST(Map, FollowsAChainOfAnchorsOfAnyLength) {
  constexpr std::size_t kLength = 60'000;  // beyond what the stack holds of calls
  std::vector<MapKeyframe> keyframes(kLength);
  for (KeyframeId id = 1; id < kLength; ++id) {
    keyframes[id].alive = false;
    keyframes[id].anchor = id - 1;
    keyframes[id].T_cam_anchor = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  }
  const Map map(0, SmallCamera(), FeatureOptions{}, {}, std::move(keyframes));
  EXPECT_EQ(map.T_cam_world(kLength - 1).translation(), Eigen::Vector3d(kLength - 1, 0, 0));
}

TEST(Map, TellsWhatIsAFeature) {
  const Feature feature{.pixel = {10, 10}, .angle_deg = 90};
  const auto is_feature = [](Feature changed) { return IsFeatureOf(SmallCamera(), 8, changed); };
  EXPECT_TRUE(is_feature(feature));
  for (const double angle_deg : {-1.0, 361.0, 1e30}) {
    Feature turned = feature;
    turned.angle_deg = angle_deg;
    EXPECT_FALSE(is_feature(turned)) << angle_deg;
  }
  Feature outside = feature;
  outside.pixel.x() = 1e9;
  EXPECT_FALSE(is_feature(outside));
  Feature on_no_level = feature;
  on_no_level.level = 8;
  EXPECT_FALSE(is_feature(on_no_level));
}

TEST(Map, TakesTheNewestKeyframesBackAsIfTheyHadNeverCome) {
  Map map = ThreeKeyframes();
  const PointId old = AddSeen(map, 0, {0, 1, 2});
  const PointId newer = AddSeen(map, 1, {1, 2});
  const PointId looks_newer = AddSeen(map, 2, {0, 1, 2});
  map.point(looks_newer).patch.emplace();
  map.point(looks_newer).patch_keyframe = 2;
  map.TakeBackKeyframes(2);
  EXPECT_EQ(map.keyframes().size(), 2U);
  ASSERT_TRUE(map.IsAlive(old));
  EXPECT_EQ(map.point(old).observations.size(), 2U);
  EXPECT_LT(map.point(old).created_at, 2U);
  EXPECT_FALSE(map.IsAlive(newer));
  EXPECT_FALSE(map.IsAlive(looks_newer));
  EXPECT_EQ(map.InOrderOfFlight(), (std::vector<KeyframeId>{0, 1}));
}

// The numbers of keyframes of the images with these indices.
Map KeyframesOf(std::initializer_list<std::int64_t> frames) {
  Map map(0, SmallCamera(), FeatureOptions{});
  for (const std::int64_t frame : frames) {
    View view = MakeView(SmallCamera(), {{50, 50}, {100, 50}});
    view.frame.index = frame;
    map.AddKeyframe(std::move(view));
  }
  return map;
}

std::vector<KeyframeId> NotFinal(Map& map) {
  const std::span<const KeyframeId> ids = map.FromFirstNotFinal();
  return {ids.begin(), ids.end()};
}

TEST(Map, KeepsItsKeyframesInTheOrderOfFlight) {
  const Map map = KeyframesOf({5, 9, 4, 3, 12});  // the start, backwards from there, and on
  EXPECT_EQ(map.InOrderOfFlight(), (std::vector<KeyframeId>{3, 2, 0, 1, 4}));
}

TEST(Map, LooksNoMoreAtKeyframesBeforeTheFirstThatIsNotFinal) {
  Map map = KeyframesOf({5, 9, 4, 12});
  EXPECT_EQ(NotFinal(map), (std::vector<KeyframeId>{2, 0, 1, 3}));
  map.keyframe(2).is_finalised = map.keyframe(0).is_finalised = map.keyframe(3).is_finalised = true;
  EXPECT_EQ(NotFinal(map), (std::vector<KeyframeId>{1, 3}));
  map.keyframe(1).is_finalised = true;
  EXPECT_TRUE(NotFinal(map).empty());
  View earlier = MakeView(SmallCamera(), {{50, 50}});
  earlier.frame.index = 7;
  map.AddKeyframe(std::move(earlier));
  EXPECT_EQ(NotFinal(map), (std::vector<KeyframeId>{4, 1, 3}));
  map.TakeBackKeyframes(3);
  EXPECT_TRUE(NotFinal(map).empty());
}

TEST(Map, WatchesNewPointsAndThoseItIsToldTo) {
  Map map = ThreeKeyframes();
  const PointId first = AddSeen(map, 0, {0, 1});
  const PointId gone = AddSeen(map, 1, {0, 1});
  const PointId last = AddSeen(map, 2, {0, 1});
  map.RemovePoint(gone);
  EXPECT_EQ(map.TakeWatched(), (std::vector<PointId>{first, last}));
  EXPECT_TRUE(map.TakeWatched().empty());
  for (int i = 0; i < 2; ++i) {
    map.Watch(last);
    map.Watch(first);
  }
  EXPECT_EQ(map.TakeWatched(), (std::vector<PointId>{first, last}));
}

TEST(Map, TellsOnceWhichKeyframesWereCulled) {
  Map map = ThreeKeyframes();
  AddSeen(map, 0, {0, 1, 2});
  map.RemoveKeyframe(1, 0);
  map.RemoveKeyframe(2, 0);
  EXPECT_EQ(map.TakeCulled(), (std::vector<KeyframeId>{1, 2}));
  EXPECT_TRUE(map.TakeCulled().empty());
}

TEST(Map, KeepsNoMemoryForWhatIsGone) {
  Map map = ThreeKeyframes();
  const PointId point = AddSeen(map, 0, {1, 2});
  map.point(point).patch = Patch();
  ASSERT_GT(map.keyframe(1).view.features.capacity(), 0U);
  map.RemoveKeyframe(1, 0);  // one observation is too few
  EXPECT_EQ(map.keyframe(1).view.features.capacity(), 0U);
  EXPECT_EQ(map.keyframe(1).view.points.capacity(), 0U);
  ASSERT_FALSE(map.IsAlive(point));
  EXPECT_EQ(map.points()[point.index].observations.capacity(), 0U);
  EXPECT_FALSE(map.points()[point.index].patch.has_value());
}

TEST(Map, RescalesAllLengths) {
  Map map = ThreeKeyframes();
  const PointId point = AddSeen(map, 0, {0, 1});
  map.RemoveKeyframe(2, 0);
  const double max_distance = map.point(point).max_distance;
  map.Rescale(1000);
  EXPECT_EQ(map.point(point).p_world.z(), 4000);
  EXPECT_EQ(map.point(point).max_distance, 1000 * max_distance);
  EXPECT_EQ(map.T_cam_world(1).translation().x(), -1000);
  EXPECT_EQ(map.T_cam_world(2).translation().x(), -2000);
}

TEST(Map, ListsTheDepthsInView) {
  Map map = ThreeKeyframes();
  AddSeen(map, 0, {0, 1});
  map.point(AddSeen(map, 1, {0, 1})).p_world = {0, 0, -1};  // behind the camera
  EXPECT_EQ(map.Depths(map.keyframe(0).view), std::vector<float>{4});
}

TEST(Map, MovesPointsAndCulledKeyframesWithTheCorrectedOnes) {
  Map map = ThreeKeyframes();
  const PointId by_first = AddSeen(map, 0, {0, 2});
  const PointId by_last = AddSeen(map, 1, {2});
  map.RemoveKeyframe(1, 0);
  const Pose T_culled_first = map.T_cam_world(1) * map.T_cam_world(0).Inverse();
  // The first keyframe takes twice the lengths around itself; the last one stays.
  const std::vector<Similarity> corrected = {Similarity(0.5, map.T_cam_world(0)),
                                             Similarity(1, map.T_cam_world(2))};
  map.Correct({0, 2}, corrected);
  EXPECT_EQ(map.keyframe(0).scale, 2);
  EXPECT_EQ(map.keyframe(1).scale, 2);
  EXPECT_EQ(map.keyframe(2).scale, 1);
  const Pose T_after = map.T_cam_world(1) * map.T_cam_world(0).Inverse();
  EXPECT_LT((T_after.translation() - 2 * T_culled_first.translation()).norm(), 1e-12);
  EXPECT_LT((map.point(by_last).p_world - Eigen::Vector3d(0, 0, 4)).norm(), 1e-12);
  // Of two observations the second counts as the middle: it stays with the last keyframe.
  EXPECT_LT((map.point(by_first).p_world - Eigen::Vector3d(0, 0, 4)).norm(), 1e-12);
  // A camera sees its own points where it saw them before, whatever its scale.
  Map other = ThreeKeyframes();
  const PointId seen = AddSeen(other, 0, {1});
  const Eigen::Vector2d before =
      other.camera().Project(other.T_cam_world(1) * other.point(seen).p_world);
  const Similarity moved(0.8, Pose(RotationExp({0.1, 0.2, 0}), {1, 2, 3}));
  other.Correct({0, 1, 2},
                {Similarity(1, other.T_cam_world(0)), moved, Similarity(1, other.T_cam_world(2))});
  const Eigen::Vector2d after =
      other.camera().Project(other.T_cam_world(1) * other.point(seen).p_world);
  EXPECT_LT((after - before).norm(), 1e-9);
}

}  // namespace
}  // namespace mono3d::tracking
