// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/control_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mono3d/geometry/distortion.h"
#include "synthetic/test_scenes.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3d;

// Straight down from 40 m, 2 m from each frame to the next.
FilmedFlight Strip(const CameraModel& camera) {
  FilmedFlight flight;
  flight.camera = camera;
  flight.num_frames = 21;
  flight.T_world_cam_at = [](int frame, double late_s) {
    const double x = 2 * frame - 20 + 10 * late_s;  // 10 m/s
    return Pose(RotationExp({std::numbers::pi, 0, 0}), Vector3d(x, 0, 40));
  };
  return flight;
}

CameraModel BentLens() {
  CameraModel camera{.width = 320, .height = 240, .fx = 300, .fy = 300, .cx = 160, .cy = 118};
  camera.distortion = {-0.1, 0.02, 0.001, -0.001, 0};
  return camera;
}

TEST(ControlPoints, LieWhereTheImagesShowThem) {
  const Scene scene = BuildPlaneAndBox();
  const FilmedFlight flight = Strip(BentLens());
  const std::vector<TrueControlPoint> points = ControlPointsOf(scene, flight, 5);
  ASSERT_GE(points.size(), 4U);
  double least_y = 1e9, most_y = -1e9;
  for (const TrueControlPoint& point : points) {
    EXPECT_TRUE(std::abs(point.p_world_m.z()) < 2e-3 || std::abs(point.p_world_m.z() - 8) < 2e-3)
        << "on the ground or on the box";
    EXPECT_GE(point.marks.size(), 3U);
    least_y = std::min(least_y, point.p_world_m.y());
    most_y = std::max(most_y, point.p_world_m.y());
    for (const TrueMark& mark : point.marks) {
      const Vector3d p_cam = flight.T_world_cam_at(mark.frame, 0).Inverse() * point.p_world_m;
      EXPECT_LT((ProjectDistorted(flight.camera, p_cam) - mark.pixel).norm(), 1e-9);
    }
  }
  EXPECT_GT(most_y - least_y, 5) << "not on a line";
}

TEST(ControlPoints, AreNotMarkedWhereSomethingHidesThem) {
  const Scene scene = BuildPlaneAndBox();
  const FilmedFlight flight = Strip(BentLens());
  // Every image is looked at by its rays: what a mark shows is the point, and no wall before it.
  for (const TrueControlPoint& point : ControlPointsOf(scene, flight, 12)) {
    for (const TrueMark& mark : point.marks) {
      const Vector3d eye = flight.T_world_cam_at(mark.frame, 0).translation();
      const Vector3d to_point = point.p_world_m - eye;
      const Vector3d short_of_it = 0.99 * to_point;
      const auto hit = scene.Intersect({eye.cast<float>(), short_of_it.cast<float>()});
      EXPECT_TRUE(!hit || hit->distance > 1) << mark.frame;
    }
  }
}

// Lines that are read later are taken from farther on.
TEST(ControlPoints, FollowTheReadoutOfARollingShutter) {
  const Scene scene = BuildPlane();
  CameraModel camera = BentLens();
  camera.distortion = {};
  camera.shutter.readout_s = 0.04;
  const FilmedFlight flight = Strip(camera);
  const std::vector<TrueControlPoint> points = ControlPointsOf(scene, flight, 4);
  ASSERT_FALSE(points.empty());
  double largest_px = 0;
  for (const TrueControlPoint& point : points) {
    for (const TrueMark& mark : point.marks) {
      const double late_s = 0.04 * LineShare(camera, mark.pixel, false);
      const Vector3d p_cam = flight.T_world_cam_at(mark.frame, late_s).Inverse() * point.p_world_m;
      EXPECT_LT((camera.Project(p_cam) - mark.pixel).norm(), 1e-3);
      const Vector3d p_still = flight.T_world_cam_at(mark.frame, 0).Inverse() * point.p_world_m;
      largest_px = std::max(largest_px, (camera.Project(p_still) - mark.pixel).norm());
    }
  }
  EXPECT_GT(largest_px, 0.3);  // 0.2 m of 40 m are 1.5 px at the outermost line
}

}  // namespace
}  // namespace mono3d::synthetic
