// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/keyframe_poses.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 1e-12;

Pose At(double x, double y, double z) {
  return {Eigen::Quaterniond::Identity(), Vector3d(x, y, z)};
}

KeyframePose Posed(std::int64_t id, int map_id, const Similarity& S_world_kf) {
  return {id, map_id, S_world_kf};
}

// Twice as large, a quarter turn about z, 10 further in x.
Similarity Turn() { return {2, Pose(RotationExp({0, 0, std::numbers::pi / 2}), {10, 0, 0})}; }

TEST(KeyframePoses, FindsKeyframesByIdWhateverTheOrder) {
  const KeyframePoses poses(
      3, {Posed(9, 0, {1, At(9, 0, 0)}), Posed(2, 1, {1, At(2, 0, 0)}), Posed(5, 0, {})});
  EXPECT_EQ(poses.version(), 3U);
  ASSERT_NE(poses.Find(2), nullptr);
  EXPECT_EQ(poses.Find(2)->map_id, 1);
  EXPECT_EQ(poses.At(9).T_world_cam().translation().x(), 9);
  EXPECT_EQ(poses.Find(4), nullptr);
  EXPECT_THROW(static_cast<void>(poses.At(4)), Error);
  EXPECT_EQ(KeyframePoses().Find(0), nullptr);
}

TEST(KeyframePoses, RefusesTwoPosesOfOneKeyframeAndPosesThatAreNotFinite) {
  EXPECT_THROW(KeyframePoses(1, {Posed(2, 0, {}), Posed(2, 1, {})}), Error);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(KeyframePoses(1, {Posed(2, 0, {1, At(nan, 0, 0)})}), Error);
  EXPECT_THROW(KeyframePoses(1, {Posed(2, 0, {nan, Pose()})}), Error);
  EXPECT_THROW(KeyframePoses(1, {Posed(2, 0, {0, Pose()})}), Error);
}

TEST(KeyframePoses, AFrameFollowsItsKeyframeInItsOwnUnit) {
  const FramePose frame = {12, 0.5, 7, At(1, 2, 3)};
  const auto entry = InWorld(frame, KeyframePoses(1, {Posed(7, 4, Turn())}));
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->frame_index, 12);
  EXPECT_EQ(entry->timestamp_s, 0.5);
  EXPECT_EQ(entry->map_id, 4);
  EXPECT_LT((entry->T_world_cam.translation() - Vector3d(6, 2, 6)).norm(), kTolerance);
  EXPECT_FALSE(InWorld(frame, KeyframePoses()));
}

TEST(FindMapJoins, FindsTheSimilarityOfAMapThatWentIntoAnother) {
  const Similarity newer(1, At(1, 2, 3));
  const KeyframePoses before(1, {Posed(0, 0, {}), Posed(1, 1, newer)});
  const KeyframePoses after(2, {Posed(0, 0, {}), Posed(1, 0, Turn() * newer)});
  const std::vector<MapJoin> joins = FindMapJoins(before, after);
  ASSERT_EQ(joins.size(), 1U);
  EXPECT_EQ(joins[0].from, 1);
  EXPECT_EQ(joins[0].into, 0);
  const Vector3d p(-4, 5, 0.5);
  EXPECT_LT((joins[0].S_into_from * p - Turn() * p).norm(), kTolerance);
  EXPECT_TRUE(FindMapJoins(after, after).empty());
}

TEST(FindMapJoins, MeasuresFromWhereALoopHadMovedTheMapByTheNewestKeyframe) {
  const Similarity loop(0.5, At(0, 3, 0));
  const Similarity elsewhere(1, At(7, 7, 7));
  const KeyframePoses first(1, {Posed(3, 1, {}), Posed(7, 1, {1, At(1, 0, 0)})});
  const KeyframePoses looped(2, {Posed(3, 1, elsewhere), Posed(7, 1, loop)});
  EXPECT_TRUE(FindMapJoins(first, looped).empty());
  const KeyframePoses joined(3, {Posed(3, 0, {}), Posed(7, 0, Turn() * loop)});
  const std::vector<MapJoin> joins = FindMapJoins(looped, joined);
  ASSERT_EQ(joins.size(), 1U);
  EXPECT_NEAR(joins[0].S_into_from.scale(), 2, kTolerance);
  const Vector3d p(1, 1, 1);
  EXPECT_LT((joins[0].S_into_from * p - Turn() * p).norm(), kTolerance);
}

TEST(FindMapJoins, ListsSeveralByTheMapThatIsNoMore) {
  const KeyframePoses before(1, {Posed(0, 0, {}), Posed(1, 2, {}), Posed(2, 1, {})});
  const KeyframePoses after(2,
                            {Posed(0, 0, {}), Posed(1, 0, {}), Posed(2, 0, {}), Posed(3, 3, {})});
  const std::vector<MapJoin> joins = FindMapJoins(before, after);
  ASSERT_EQ(joins.size(), 2U);
  EXPECT_EQ(joins[0].from, 1);
  EXPECT_EQ(joins[1].from, 2);
}

// The unit of the reference is twice that of the world.
TEST(SetPoses, AreRelativeToTheReferenceInItsOwnUnit) {
  ImageBundle bundle;
  bundle.keyframes.resize(3);
  for (int i = 0; i < 3; ++i) bundle.keyframes[static_cast<std::size_t>(i)].id = i;
  const Similarity reference(2, At(4, 0, 0));
  std::vector<KeyframePose> list = {Posed(0, 0, {1, At(2, 0, 0)}), Posed(1, 0, reference),
                                    Posed(2, 0, {3, At(7, 0, 0)})};
  ASSERT_TRUE(SetPoses(KeyframePoses(1, list), bundle));
  ASSERT_EQ(bundle.T_ref_cam.size(), 3U);
  EXPECT_LT((bundle.T_ref_cam[0].translation() - Vector3d(-1, 0, 0)).norm(), kTolerance);
  EXPECT_EQ(bundle.T_ref_cam[1].translation(), Vector3d::Zero());
  EXPECT_LT((bundle.T_ref_cam[2].translation() - Vector3d(1.5, 0, 0)).norm(), kTolerance);

  const std::vector<Pose> before = bundle.T_ref_cam;
  list[2].map_id = 1;
  EXPECT_FALSE(SetPoses(KeyframePoses(2, list), bundle));
  list.pop_back();
  EXPECT_FALSE(SetPoses(KeyframePoses(3, list), bundle));
  EXPECT_EQ(bundle.T_ref_cam[2].translation(), before[2].translation());
}

}  // namespace
}  // namespace mono3d
