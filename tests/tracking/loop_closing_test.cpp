// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/loop_closing.h"

#include <gtest/gtest.h>

#include <memory>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/features/feature_extraction.h"
#include "tracking/features/feature_grid.h"
#include "tracking/map/keyframe_handover.h"
#include "tracking/map/published_poses.h"
#include "tracking/optimisation/scale_gauge.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

constexpr int kNumOutward = 12;
constexpr double kDriftScale = 1.3;

// Where a pixel of a true camera lies on the ground z = 0.
Eigen::Vector3d OnGround(const Pose& T_world_cam, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = T_world_cam.rotation() * SmallCamera().Unproject(pixel);
  return T_world_cam.translation() - T_world_cam.translation().z() / ray.z() * ray;
}

// The world as the camera has it on its way back: too large by a factor, about where it turned.
struct Drift {
  double scale = 1;
  Eigen::Vector3d about;
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return about + scale * (p - about); }
  Pose operator*(const Pose& T_world_cam) const {
    return {T_world_cam.rotation(), *this * T_world_cam.translation()};
  }
};

struct DriftedMap {
  Map map{0, SmallCamera(), FeatureOptions{}};
  PlaceIndex index;
  std::vector<Pose> truth;  // T_world_cam of each keyframe
};

// Out over the meadow and back again, each leg with points of its own, which neighbours share.
DriftedMap OutAndBack() {
  static const Sequence flight = FlyOver(TexturedGround(false), kNumOutward);
  DriftedMap world;
  for (int i = 0; i < 2 * kNumOutward; ++i) {
    const bool is_outward = i < kNumOutward;
    const auto at = static_cast<std::size_t>(is_outward ? i : 2 * kNumOutward - 1 - i);
    const Pose& T_true = flight.T_world_cam[at];
    const Drift drift{is_outward ? 1 : kDriftScale,
                      flight.T_world_cam[kNumOutward - 1].translation()};
    View view;
    view.frame = flight.frames[at];
    view.frame.index = i;
    view.octaves = BuildOctaves(ToGrey(view.frame.bgr));
    view.T_cam_world = (drift * T_true).Inverse();
    // Neighbours take their own from different stripes of the ground.
    for (const Feature& feature : ExtractFeatures(view.octaves[0], {}, 900)) {
      const double stripe = 2 * OnGround(T_true, feature.pixel).x() + 300;
      if ((static_cast<int>(stripe) + i) % 3 == 0) view.features.push_back(feature);
    }
    view.grid = FeatureGrid(view.features, 384, 224);
    view.points.resize(view.features.size());
    const auto id = world.map.AddKeyframe(view);
    world.truth.push_back(T_true);
    for (std::size_t k = 0; k < view.features.size(); ++k) {
      const Eigen::Vector3d p = OnGround(T_true, view.features[k].pixel);
      const PointId point = world.map.AddPoint(drift * p);
      world.map.AddObservation(point, {id, k});
      // The keyframes before see it too, as features of their own.
      for (KeyframeId before = id; before-- > (is_outward ? 0U : kNumOutward) && before + 3 > id;) {
        Feature feature = view.features[k];
        feature.pixel = SmallCamera().Project(world.truth[before].Inverse() * p);
        if (SmallCamera().Contains(feature.pixel)) {
          world.map.AddObservation(point, before, feature);
        }
      }
      world.map.UpdatePoint(point);
      TakePatchOf(world.map, point, id, view.features[k]);
    }
    world.index.Add(id, FeaturesWithPoints(world.map.keyframe(id).view));
  }
  return world;
}

TEST(FindLoop, FindsTheWayBackWithItsScale) {
  DriftedMap world = OutAndBack();
  const KeyframeId last = 2 * kNumOutward - 1;
  const std::optional<PlaceFound> loop = FindLoop(world.map, world.index, last, 1);
  ASSERT_TRUE(loop.has_value());
  EXPECT_LT(loop->old_keyframe, 4U);
  EXPECT_GE(loop->num_inliers, 50);
  EXPECT_NEAR(loop->scale, 1 / kDriftScale, 0.005);
  const Pose T_world_cam = loop->T_cam_world.Inverse();
  EXPECT_LT((T_world_cam.translation() - world.truth[last].translation()).norm(), 0.03);
  EXPECT_GE(loop->same.size(), 20U);
}

TEST(FindLoop, SeesNoneWhereTheCameraHasNotBeen) {
  DriftedMap world = OutAndBack();
  // In the middle of the flight the old keyframes are still connected.
  EXPECT_FALSE(FindLoop(world.map, world.index, kNumOutward / 2, 1).has_value());
  EXPECT_FALSE(FindLoop(world.map, PlaceIndex(), 2 * kNumOutward - 1, 1).has_value());
}

// What was handed out stays in the unit that it has, which the snapshot turns into the world's.
TEST(CloseLoop, ChangesTheScaleOfKeyframesThatWereHandedOutOnlyInTheSnapshot) {
  DriftedMap world = OutAndBack();
  std::vector<std::unique_ptr<Map>> maps;
  maps.push_back(std::make_unique<Map>(std::move(world.map)));
  Map& map = *maps[0];
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    map.keyframe(id).id = static_cast<std::int64_t>(id);
  }
  const std::vector<Keyframe> keyframes = TakeFinalised(map, true);
  PublishedPoses poses;
  poses.Publish(maps);
  const KeyframePosesPtr before = poses.Latest();
  const KeyframeId last = 2 * kNumOutward - 1;
  const std::optional<PlaceFound> loop = FindLoop(map, world.index, last, 1);
  ASSERT_TRUE(loop.has_value());
  MappingLock alone;
  CloseLoop(map, *loop, {}, alone);
  poses.Publish(maps);
  const KeyframePosesPtr after = poses.Latest();
  EXPECT_GT(after->version(), before->version());
  ASSERT_EQ(keyframes.size(), map.keyframes().size());
  for (const Keyframe& keyframe : keyframes) {
    EXPECT_EQ(before->At(keyframe.id).S_world_kf.scale(), 1);
    const float depth_in_world = UpperMedianOrZero(map.Depths(map.keyframe(keyframe.id).view));
    const float depth_by_pose = static_cast<float>(after->At(keyframe.id).S_world_kf.scale()) *
                                UpperMedianOrZero(keyframe.sparse_depths_su);
    // They see other points now, of ground at 10 to 25; without the scale it would be 0.23.
    constexpr float kShare = 0.05F;
    EXPECT_NEAR(depth_by_pose, depth_in_world, kShare * depth_in_world);
  }
  const auto last_id = static_cast<std::int64_t>(last);
  EXPECT_NEAR(after->At(last_id).S_world_kf.scale(), 1 / kDriftScale, 0.02);
}

TEST(CloseLoop, TakesMostOfTheDriftAway) {
  DriftedMap world = OutAndBack();
  const KeyframeId last = 2 * kNumOutward - 1;
  const auto gap = [&] {  // between the first and the last keyframe, which are in one place
    return (world.map.keyframe(0).view.Centre() - world.map.keyframe(last).view.Centre()).norm();
  };
  const double before = gap();
  ASSERT_GT(before, 0.5);
  const std::optional<PlaceFound> loop = FindLoop(world.map, world.index, last, 1);
  ASSERT_TRUE(loop.has_value());
  MappingLock alone;
  const KeyframeId gauge = FindScaleKeyframe(world.map, 0).value();
  EXPECT_GE(gauge, 2U);  // as far as points are shared, outward
  EXPECT_LT(gauge, KeyframeId{kNumOutward});
  CloseLoop(world.map, *loop, {}, alone);
  EXPECT_LT(gap(), 0.1 * before);
  // Two hundredths: the pose graph leaves a part of it to the adjustment of points and views.
  EXPECT_NEAR(world.map.keyframe(last).scale, 1 / kDriftScale, 0.02);
  EXPECT_NEAR(world.map.keyframe(0).scale, 1, 0.002);  // its neighbours' points move a little
  EXPECT_FALSE(world.map.CovisibleKeyframes(last).empty());
  // Both ends share points now.
  int num_shared_with_old = 0;
  for (const Covisible& other : world.map.CovisibleKeyframes(last)) {
    if (other.keyframe < 4) num_shared_with_old += other.num_shared;
  }
  // Not only those at which each side had a feature of its own: all whose patches show.
  constexpr int kMinShared = 1000;
  EXPECT_GT(num_shared_with_old, kMinShared);
  EXPECT_LT(8 * loop->same.size(), std::size_t{kMinShared});
}

}  // namespace
}  // namespace mono3d::tracking
