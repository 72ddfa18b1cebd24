// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/point_culling.h"

#include <gtest/gtest.h>

#include <vector>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kMany = 40;  // keyframes, more than any single flight past a place has

// Points on a plane 10 before the first three keyframes, which all show the same ones: `kTested`,
// which is to be culled or not, and others, which all keyframes show, so that they hang together.
class PointCulling : public testing::Test {
 protected:
  static constexpr PointId kTested{0};

  PointCulling() {
    for (int x = -2; x <= 2; ++x) points_.emplace_back(x, 0.5 * (x % 2), 10);
    for (int i = 0; i < 3; ++i) AddKeyframe(Pose());
    for (const Eigen::Vector3d& p : points_) {
      const PointId id = map_.AddPoint(p);
      for (KeyframeId keyframe = 0; keyframe < 3; ++keyframe) {
        map_.AddObservation(id, {keyframe, id.index});
      }
      map_.UpdatePoint(id);
    }
  }

  KeyframeId AddKeyframe(const Pose& T_cam_world) {
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector3d& p : points_) {
      pixels.push_back(SmallCamera().Project(T_cam_world * p));
    }
    View view = MakeView(SmallCamera(), pixels);
    view.T_cam_world = T_cam_world;
    return map_.AddKeyframe(std::move(view));
  }

  // A keyframe that shows the others, and the tested one if so asked; then culls.
  void Visit(const Pose& T_cam_world, bool shows_tested) {
    const KeyframeId keyframe = AddKeyframe(T_cam_world);
    for (const PointId id : map_.PointIds()) {
      if (id == kTested && !shows_tested) continue;
      map_.AddObservation(id, {keyframe, id.index});
      map_.UpdatePoint(id);
    }
    CountShown(map_, keyframe);
    CullPoints(map_);
  }

  bool IsInView(const Pose& T_cam_world) const {
    return SmallCamera().Contains(SmallCamera().Project(T_cam_world * points_[kTested.index]));
  }
  bool TestedIsAlive() const { return map_.IsAlive(kTested); }

  std::vector<Eigen::Vector3d> points_;
  Map map_{0, SmallCamera(), FeatureOptions{}};
};

// What a keyframe costs must not grow with the map.
TEST_F(PointCulling, LooksAgainOnlyAtPointsOnProbationAndAtThoseThatWereDue) {
  for (int i = 0; i < 3; ++i) Visit(Pose(), true);
  EXPECT_EQ(map_.TakeWatched().size(), points_.size());  // created with the third keyframe
  for (const PointId id : map_.PointIds()) map_.Watch(id);
  Visit(Pose(), true);
  EXPECT_TRUE(map_.TakeWatched().empty());
  CountShown(map_, AddKeyframe(Pose()));
  EXPECT_TRUE(map_.TakeWatched().empty());  // nothing that it shares with others
  Visit(Pose(), false);
  CountShown(map_, map_.keyframes().size() - 1);
  EXPECT_EQ(map_.TakeWatched().size(), points_.size());  // all of them were due there
}

TEST_F(PointCulling, TakesPointsThatManyKeyframesDoNotShowButNotTheOthers) {
  for (int i = 0; i < kMany; ++i) Visit(Pose(), false);
  EXPECT_FALSE(TestedIsAlive());
  EXPECT_EQ(map_.PointIds().size(), points_.size() - 1);
}

TEST_F(PointCulling, LeavesPointsAloneThatASingleFlightPastDoesNotShowAgain) {
  for (int i = 0; i < 14; ++i) Visit(Pose(), false);
  EXPECT_TRUE(TestedIsAlive());
}

TEST_F(PointCulling, KeepsPointsThatEveryThirdKeyframeShows) {
  for (int i = 0; i < kMany; ++i) Visit(Pose(), i % 3 == 2);
  EXPECT_TRUE(TestedIsAlive());
}

TEST_F(PointCulling, TakesPointsThatEveryFifthKeyframeShows) {
  for (int i = 0; i < kMany; ++i) Visit(Pose(), i % 5 == 4);
  EXPECT_FALSE(TestedIsAlive());
}

TEST_F(PointCulling, ExpectsNothingOfAViewFromElsewhere) {
  // From 25 degrees aside, and from twice as far: the point is in view, but looks otherwise.
  const Pose aside = Pose(RotationExp({0, -0.44, 0}), Eigen::Vector3d(4.5, 0, 0)).Inverse();
  const Pose far(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 10));
  for (const Pose& T_cam_world : {aside, far}) {
    ASSERT_TRUE(IsInView(T_cam_world));
    for (int i = 0; i < kMany; ++i) Visit(T_cam_world, false);
  }
  EXPECT_TRUE(TestedIsAlive());
  EXPECT_EQ(map_.point(kTested).num_due_keyframes, 0);
}

TEST_F(PointCulling, ExpectsNothingOfAViewThatThePointIsOutside) {
  const Pose turned(RotationExp({0, -0.4, 0}), Eigen::Vector3d::Zero());
  ASSERT_FALSE(IsInView(turned));
  for (int i = 0; i < kMany; ++i) Visit(turned, false);
  EXPECT_TRUE(TestedIsAlive());
}

TEST_F(PointCulling, TakesNewPointsThatFewerThanThreeKeyframesSee) {
  const KeyframeId second = AddKeyframe(Pose());
  const KeyframeId third = AddKeyframe(Pose());
  const PointId seen_twice = map_.AddPoint({0, 1, 10});
  map_.AddObservation(seen_twice, {second, 1});
  map_.AddObservation(seen_twice, {third, 1});
  CullPoints(map_);
  EXPECT_TRUE(map_.IsAlive(seen_twice));
  AddKeyframe(Pose());
  AddKeyframe(Pose());
  CullPoints(map_);
  EXPECT_FALSE(map_.IsAlive(seen_twice));
  EXPECT_TRUE(TestedIsAlive());
}

}  // namespace
}  // namespace mono3d::tracking
