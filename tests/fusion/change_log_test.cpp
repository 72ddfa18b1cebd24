// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <map>

#include "fusion/registration_scene.h"
#include "gpu/test_device.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

// What a viewer keeps.
struct Viewer {
  void Look(TrackedModel& model) {
    changes = model.model().ChangesSince(changes.version);
    for (const SurfelChunk& chunk : changes.changed) chunks[chunk.anchor] = chunk.surfels;
  }

  // In the world, in the order of the anchors.
  std::vector<Eigen::Vector3f> Points() const {
    std::vector<Eigen::Vector3f> points;
    for (const SurfelAnchor& anchor : changes.anchors) {
      for (const auto& p : chunks.at(anchor.number)->points) {
        points.push_back((anchor.S_world_anchor * p.cast<double>()).cast<float>());
      }
    }
    return points;
  }

  SurfelChanges changes;
  std::map<std::uint32_t, std::shared_ptr<const PointCloud>> chunks;
};

void ExpectSame(const Viewer& viewer, const TrackedModel& model) {
  constexpr float kRounding_su = 1e-4F;
  const std::vector<Eigen::Vector3f> found = viewer.Points();
  const PointCloud expected = model.Export(1);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_LT((found[i] - expected.points[i]).norm(), kRounding_su) << i;
  }
}

TrackedMap View(double angle_deg, int number) {
  TrackedMap map = HouseView({}, angle_deg);
  map.keyframe_id = map.frame_index = number;
  return map;
}

TEST(SurfelChanges, AddUpToTheModel) {
  const auto model = CreateTrackedModel();
  Viewer viewer;
  for (int i = 0; i < 5; ++i) {
    (void)model->Integrate(View(4.0 * i, i));
    viewer.Look(*model);
    EXPECT_EQ(viewer.changes.anchors.size(), static_cast<std::size_t>(i + 1));
    EXPECT_EQ(viewer.changes.anchors.back().keyframe_id, i);
    ExpectSame(viewer, *model);
  }
  viewer.Look(*model);
  EXPECT_TRUE(viewer.changes.changed.empty());
  // Another viewer gets all of it.
  Viewer other;
  other.Look(*model);
  EXPECT_EQ(other.changes.changed.size(), 5U);
  ExpectSame(other, *model);
}

TEST(SurfelChanges, AreNoneWhereKeyframesMove) {
  const auto model = CreateTrackedModel();
  (void)model->Integrate(View(0, 0));
  (void)model->Integrate(View(4, 1));
  Viewer viewer;
  viewer.Look(*model);
  const Similarity motion(1.5, Pose(RotationExp({0.1, 0.2, 0.3}), Eigen::Vector3d(4, 5, 6)));
  std::vector<KeyframePose> moved;
  const KeyframePoses poses = model->Poses();
  for (const KeyframePose& pose : poses.poses()) {
    moved.push_back({pose.keyframe_id, 0, motion * pose.S_world_kf});
  }
  EXPECT_TRUE(model->Update(moved).has_moved);
  viewer.Look(*model);
  EXPECT_TRUE(viewer.changes.changed.empty());
  ExpectSame(viewer, *model);
}

// A depth map touches what it sees.
TEST(SurfelChanges, AreOfTheAnchorsInView) {
  const auto model = CreateTrackedModel();
  const auto over = [](double x_su, int number) {
    TrackedMap map = HouseViewFrom({}, PoseOver(x_su, 0));
    map.keyframe_id = map.frame_index = number;
    return map;
  };
  (void)model->Integrate(over(-40, 0));
  (void)model->Integrate(over(0, 1));
  Viewer viewer;
  viewer.Look(*model);
  (void)model->Integrate(over(1, 2));
  viewer.Look(*model);
  ASSERT_EQ(viewer.changes.changed.size(), 2U);
  EXPECT_EQ(viewer.changes.changed[0].anchor, 1U);
  EXPECT_EQ(viewer.changes.changed[1].anchor, 2U);
}

}  // namespace
}  // namespace mono3d
