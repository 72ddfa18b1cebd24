// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/next_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace mono3d {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kHalfBox = 1;
constexpr double kBoxHeight = 2;

Pose Towards(const Eigen::Vector3d& from, const Eigen::Vector3d& target) {
  const Eigen::Vector3d ahead = (target - from).normalized();
  const Eigen::Vector3d right = ahead.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << right, ahead.cross(right), ahead;
  return {R, from};
}

// Does the line between two points go through the box on the ground in the middle?
bool IsHiddenByBox(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Array3d low(-kHalfBox, -kHalfBox, 0), high(kHalfBox, kHalfBox, kBoxHeight);
  double enter = 0.001, leave = 1;
  for (int i = 0; i < 3; ++i) {
    const double step = b[i] - a[i];
    if (std::abs(step) < 1e-12) {
      if (a[i] <= low[i] || a[i] >= high[i]) return false;
      continue;
    }
    const double s = (low[i] - a[i]) / step, t = (high[i] - a[i]) / step;
    enter = std::max(enter, std::min(s, t));
    leave = std::min(leave, std::max(s, t));
  }
  return enter + 1e-6 < leave;
}

// A box on the ground, as cameras see it that look at it.
class BoxScene {
 public:
  BoxScene() {
    map_.axes.source = AxesSource::kLevel;
    map_.sparse.camera.width = 640;
    map_.sparse.camera.height = 480;
    map_.sparse.camera.fx = map_.sparse.camera.fy = 500;
    map_.sparse.camera.cx = 319.5;
    map_.sparse.camera.cy = 239.5;
  }

  // Around the box between two azimuths, 0 at its side towards -y.
  void Fly(double from_deg, double to_deg, double height, double distance = 7) {
    for (double azimuth = from_deg; azimuth < to_deg; azimuth += 10) {
      const Eigen::Vector3d from(distance * std::sin(azimuth * kDegree),
                                 -distance * std::cos(azimuth * kDegree), height);
      TrajectoryEntry entry;
      entry.frame_index = static_cast<std::int64_t>(map_.model_trajectory.size());
      entry.T_world_cam = Towards(from, {0, 0, 0.5});
      map_.model_trajectory.push_back(entry);
    }
  }

  // `observations_at`: of a point that so many cameras see.
  MapReconstruction Seen(
      const std::function<std::uint32_t(const Eigen::Vector3d&, std::uint32_t)>& observations_at =
          [](const auto&, std::uint32_t num) { return num; }) {
    constexpr double kStep = 0.05;
    for (double x = -4; x < 4; x += kStep) {
      for (double y = -4; y < 4; y += kStep) {
        const bool is_box = std::max(std::abs(x), std::abs(y)) < kHalfBox;
        Add({x, y, is_box ? kBoxHeight : 0}, Eigen::Vector3d::UnitZ(), observations_at);
      }
    }
    for (double along = -kHalfBox; along < kHalfBox; along += kStep) {
      for (double z = kStep; z < kBoxHeight; z += kStep) {
        for (const double side : {-1.0, 1.0}) {
          Add({along, side * kHalfBox, z}, {0, side, 0}, observations_at);
          Add({side * kHalfBox, along, z}, {side, 0, 0}, observations_at);
        }
      }
    }
    return map_;
  }

 private:
  void Add(
      const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
      const std::function<std::uint32_t(const Eigen::Vector3d&, std::uint32_t)>& observations_at) {
    std::uint32_t num = 0;
    for (const TrajectoryEntry& entry : map_.model_trajectory) {
      const Pose& T_world_cam = entry.T_world_cam;
      const Eigen::Vector3d towards = T_world_cam.translation() - p;
      const Eigen::Vector3d p_cam = T_world_cam.Inverse() * p;
      if (normal.dot(towards) <= 0 || p_cam.z() <= 0) continue;
      if (!map_.sparse.camera.Contains(map_.sparse.camera.Project(p_cam))) continue;
      if (!IsHiddenByBox(p, T_world_cam.translation())) ++num;
    }
    if (num == 0) return;
    map_.model.points.push_back(p.cast<float>());
    map_.model.normals.push_back(normal.cast<float>());
    map_.model.radii.push_back(0.04F);
    map_.model.confidences.push_back(0.8F);
    map_.model.observations.push_back(observations_at(p, num));
  }

  MapReconstruction map_;
};

Eigen::Vector3d Ahead(const NextView& view) {
  return view.T_world_cam.rotation() * Eigen::Vector3d::UnitZ();
}

TEST(NextViews, LookAtTheSideThatNobodySaw) {
  BoxScene scene;
  scene.Fly(-30, 30, 3.5);
  const NextViews next = ProposeNextViews(scene.Seen());
  ASSERT_FALSE(next.views.empty());
  const NextView& first = next.views.front();
  EXPECT_EQ(first.MainNeed(), ViewNeed::kHidden);
  // The flight looked towards +y; what it did not see is behind the box.
  EXPECT_LT(Ahead(first).y(), 0.3);
  EXPECT_GT(first.target_world.y(), 0);
  EXPECT_GT(first.Gain(), 0.5 * 2 * kHalfBox * kBoxHeight) << "half a side of the box";
  // From as far as before, at a height of the flight, towards the target, and level.
  EXPECT_NEAR(next.distance_su, 7.5, 1);
  const Eigen::Vector3d from = first.T_world_cam.translation();
  EXPECT_NEAR((first.target_world - from).norm(), next.distance_su, 1e-6);
  EXPECT_NEAR(Ahead(first).dot((first.target_world - from).normalized()), 1, 1e-9);
  EXPECT_NEAR((first.T_world_cam.rotation() * Eigen::Vector3d::UnitX()).z(), 0, 1e-9);
  EXPECT_GT(from.z(), 2.5);
  EXPECT_LT(from.z(), 6);
  EXPECT_FALSE(IsHiddenByBox(from, first.target_world));
  EXPECT_LE(next.views.size(), 12U);
}

TEST(NextViews, AreFewWhereAllHasBeenSeen) {
  BoxScene one_side, all_sides;
  one_side.Fly(-30, 30, 3.5);
  all_sides.Fly(0, 360, 3.5);
  all_sides.Fly(0, 360, 6);
  const NextViews few = ProposeNextViews(all_sides.Seen());
  EXPECT_TRUE(few.views.empty()) << few.views.front().Gain();
  const NextViews many = ProposeNextViews(one_side.Seen());
  const auto hidden_su2 = [](const NextViews& next) {
    const auto found = next.area_su2.find(ViewNeed::kHidden);
    return found == next.area_su2.end() ? 0 : found->second;
  };
  EXPECT_LT(hidden_su2(few), 0.1 * hidden_su2(many));
  EXPECT_GT(few.surface_su2, 50) << "of 8 x 8 of ground and the box";
}

TEST(NextViews, LookAtWhatIsThin) {
  BoxScene scene;
  scene.Fly(0, 360, 3.5);
  scene.Fly(0, 360, 6);
  // A corner of the ground was in one depth map.
  const NextViews next =
      ProposeNextViews(scene.Seen([](const Eigen::Vector3d& p, std::uint32_t num) {
        return p.x() > 1.2 && p.y() > 1.2 ? 1U : num;
      }));
  ASSERT_EQ(next.views.size(), 1U);
  EXPECT_EQ(next.views[0].MainNeed(), ViewNeed::kThin);
  EXPECT_GT(next.views[0].target_world.x(), 1);
  EXPECT_GT(next.views[0].target_world.y(), 1);
  EXPECT_NEAR(next.views[0].Gain(), 2.8 * 2.8, 2.5);
}

TEST(NextViews, LookFromAnotherSide) {
  BoxScene scene;
  scene.Fly(-5, 5, 5);
  scene.Fly(-5, 5, 5.2);
  const NextViews next = ProposeNextViews(scene.Seen());
  ASSERT_FALSE(next.views.empty());
  ASSERT_TRUE(next.area_su2.contains(ViewNeed::kOneSided));
  bool looks_from_another_side = false;
  for (const NextView& view : next.views) {
    looks_from_another_side |= view.gain_su2.contains(ViewNeed::kOneSided);
  }
  EXPECT_TRUE(looks_from_another_side);
}

TEST(NextViews, AreNoneWithoutAModel) {
  EXPECT_TRUE(ProposeNextViews({}).views.empty());
  BoxScene scene;
  EXPECT_TRUE(ProposeNextViews(scene.Seen()).views.empty()) << "nothing was seen";
}

}  // namespace
}  // namespace mono3d
