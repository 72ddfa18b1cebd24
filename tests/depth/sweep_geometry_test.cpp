// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sweep_geometry.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "depth/plane_scene.h"
#include "depth/sweep_plan.h"

namespace mono3d {
namespace {

constexpr double kRounding = 1e-9;

SweepLimits NoLimits() {
  return {.level = 0,
          .max_planes = 1000,
          .max_buffer_bytes = std::uint64_t{1} << 40,
          .padded_planes = [](std::uint32_t n) { return n; }};
}

TEST(SweepGeometry, ProjectsLikeTheCameras) {
  const ImageBundle bundle = PlaneScene().Bundle();
  const SweepGeometry geometry(bundle);
  const CameraModel& camera = geometry.camera();
  for (const int level : {0, 2}) {
    const CameraModel halved = HalvedCamera(camera, level);
    const Eigen::Vector3d p(7, 5, 1);
    const double depth = 1.7;
    const Eigen::Vector3d p_ref = depth * halved.Unproject(p.head<2>());
    std::size_t source = 0;
    for (const std::size_t i : {0, 1, 3, 4}) {
      const SourceProjection projection = geometry.Projections(level)[source++];
      const Eigen::Vector2d expected = halved.Project(bundle.T_ref_cam[i].Inverse() * p_ref);
      const Eigen::Vector2d found = (projection.A * p + projection.b / depth).hnormalized();
      EXPECT_LT((found - expected).norm(), kRounding);
    }
  }
}

// Each side is half the sources; the smaller one is filled up with sources that see nothing.
TEST(SweepGeometry, FillsUpTheSmallerSide) {
  ImageBundle bundle = PlaneScene().Bundle();
  bundle.keyframes.erase(bundle.keyframes.begin());
  bundle.T_ref_cam.erase(bundle.T_ref_cam.begin());
  bundle.num_first_side = 1;
  const auto indices = IndicesOfSources(bundle);
  ASSERT_EQ(indices.size(), 4U);
  EXPECT_EQ(indices[0], 0U);
  EXPECT_FALSE(indices[1]);
  EXPECT_EQ(indices[2], 2U);
  EXPECT_EQ(indices[3], 3U);
  const SweepGeometry geometry(bundle);
  ASSERT_EQ(geometry.num_sources(), 4U);
  for (const int level : {0, 2}) {
    const SourceProjection nothing = geometry.Projections(level)[1];
    for (const double w : {0.0, 0.3, 10.0}) {
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(159, 95, 1)}) {
        EXPECT_LT((nothing.A * p + w * nothing.b).z(), 0);
      }
    }
  }
}

TEST(SweepPlan, MovesAtMostOnePixelFromPlaneToPlaneInEachCamera) {
  const SweepGeometry geometry(PlaneScene().Bundle());
  const InverseDepthRange range{0.3, 0.9};
  const SweepPlan plan = PlanSweep(geometry, range, NoLimits());
  EXPECT_LE(plan.inverse_depth, range.farthest);
  EXPECT_GE(plan.inverse_depth + plan.step * (plan.num_planes - 1), range.nearest);
  double largest = 0;
  for (const SourceProjection& source : geometry.Projections(0)) {
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(159, 95, 1),
                                     Eigen::Vector3d(80, 48, 1), Eigen::Vector3d(159, 0, 1)}) {
      for (std::uint32_t k = 0; k + 1 < plan.num_planes; ++k) {
        const double w = plan.inverse_depth + k * plan.step;
        const Eigen::Vector2d here = (source.A * p + w * source.b).hnormalized();
        const Eigen::Vector2d next = (source.A * p + (w + plan.step) * source.b).hnormalized();
        if (geometry.camera().Contains(here)) largest = std::max(largest, (next - here).norm());
      }
    }
  }
  // At most one, and not much less: planes are not wasted.
  EXPECT_LE(largest, 1.05);  // the fastest pixel of a grid, not of all
  EXPECT_GE(largest, 0.8);
}

TEST(SweepPlan, GoesCoarserUntilThePlanesFit) {
  const SweepGeometry geometry(PlaneScene().Bundle());
  const InverseDepthRange range{0.0, 2.0};
  SweepLimits limits = NoLimits();
  const SweepPlan fine = PlanSweep(geometry, range, limits);
  EXPECT_EQ(fine.level, 0);
  limits.max_planes = fine.num_planes - 1;
  EXPECT_EQ(PlanSweep(geometry, range, limits).level, 1);
  limits = NoLimits();
  limits.max_buffer_bytes = 2 * fine.size.num_pixels() * fine.num_planes - 1;
  EXPECT_EQ(PlanSweep(geometry, range, limits).level, 1);
}

TEST(AddNearerPlanes, GoesOnAtTheSameStepAsFarAsAnythingIsSeen) {
  const SweepGeometry geometry(PlaneScene().Bundle());
  const SweepPlan plan = PlanSweep(geometry, {0.3, 0.6}, NoLimits());
  const auto nearest_estimate = [](const SweepPlan& of) {
    return of.inverse_depth + of.step * (of.num_planes - 2);
  };
  SweepPlan longer = plan;
  AddNearerPlanes(geometry, 1.2, NoLimits(), longer);
  EXPECT_EQ(longer.inverse_depth, plan.inverse_depth);
  EXPECT_EQ(longer.step, plan.step);
  EXPECT_EQ(longer.level, plan.level);
  EXPECT_GE(nearest_estimate(longer), 1.2);
  EXPECT_LT(nearest_estimate(longer) - longer.step, 1.2);
  SweepLimits limits = NoLimits();
  limits.max_planes = plan.num_planes + 2;
  SweepPlan limited = plan;
  AddNearerPlanes(geometry, 1.2, limits, limited);
  EXPECT_EQ(limited.num_planes, limits.max_planes);
  // The nearest source is a tenth of the depth away and sees nothing that is nearer than that.
  SweepPlan longest = plan;
  AddNearerPlanes(geometry, 100, NoLimits(), longest);
  EXPECT_GE(geometry.VisibleShare(nearest_estimate(longest)), 0.1);
  EXPECT_LT(geometry.VisibleShare(nearest_estimate(longest) + longest.step), 0.1);
}

TEST(RangeOfDepths, HoldsAllButOutliersWithAMargin) {
  std::vector<float> depths;
  for (int i = 0; i < 100; ++i) depths.push_back(10 + 0.1f * float(i));
  depths.push_back(0.01f);
  depths.push_back(1e6f);
  depths.push_back(-3);
  depths.push_back(std::nanf(""));
  const auto range = RangeOfDepths(depths);
  ASSERT_TRUE(range);
  EXPECT_GT(range->nearest, 1 / 10.0);
  EXPECT_LT(range->nearest, 1 / 7.0);
  EXPECT_LT(range->farthest, 1 / 20.0);
  EXPECT_GT(range->farthest, 1 / 50.0);
}

TEST(RangeOfDepths, IsEmptyForAHandfulOfPoints) {
  EXPECT_FALSE(RangeOfDepths({}));
  EXPECT_FALSE(RangeOfDepths(std::vector<float>(24, 3.f)));
}

TEST(SweepGeometry, WidestRangeEndsWhereHalfTheReferenceIsSeen) {
  const SweepGeometry geometry(PlaneScene().Bundle());
  const auto range = geometry.WidestRange();
  ASSERT_TRUE(range);
  EXPECT_EQ(range->farthest, 0);
  EXPECT_GE(geometry.VisibleShare(range->nearest), 0.5);
  EXPECT_LT(geometry.VisibleShare(1.2 * range->nearest), 0.5);
}

}  // namespace
}  // namespace mono3d
