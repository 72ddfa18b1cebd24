// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/patch_normal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

// The plane normal . p = distance.
struct Plane {
  Eigen::Vector3d normal;
  double distance = 1;

  double InverseDepth(const CameraModel& camera, const Eigen::Vector2d& pixel) const {
    return normal.dot(camera.Unproject(pixel)) / distance;
  }
  // By central differences.
  Eigen::Vector2d Normal(const CameraModel& camera, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d by_x(0.5, 0);
    const Eigen::Vector2d by_y(0, 0.5);
    return Eigen::Vector2d(
               InverseDepth(camera, pixel + by_x) - InverseDepth(camera, pixel - by_x),
               InverseDepth(camera, pixel + by_y) - InverseDepth(camera, pixel - by_y)) /
           InverseDepth(camera, pixel);
  }
};

const Pose kOther(RotationExp({0.2, -0.3, 0.1}), {0.5, 0.2, -0.3});  // T_b_a
const Eigen::Vector2d kPixel(250, 60);

struct Case {
  Plane in_a{Eigen::Vector3d(0.3, -0.5, 1).normalized(), 4};
  Plane in_b;
  Eigen::Vector2d pixel_b;

  Case() {
    const CameraModel camera = SmallCamera();
    const Eigen::Vector3d p_a = camera.Unproject(kPixel) / in_a.InverseDepth(camera, kPixel);
    pixel_b = camera.Project(kOther * p_a);
    in_b.normal = kOther.rotation() * in_a.normal;
    in_b.distance = in_b.normal.dot(kOther * p_a);
  }
};

TEST(FacingNormal, IsOfAPlaneAcrossTheRay) {
  const CameraModel camera = SmallCamera();
  const Plane across{camera.Unproject(kPixel), 7};
  EXPECT_LT((FacingNormal(camera, kPixel) - across.Normal(camera, kPixel)).norm() * camera.fx,
            1e-9);
  EXPECT_TRUE(IsPlausible(camera, kPixel, FacingNormal(camera, kPixel)));
}

TEST(IsPlausible, EndsWhereASurfaceIsAnEdge) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  const auto leaning = [&](double degrees) {
    const double radians = degrees * M_PI / 180;
    return Plane{{std::sin(radians), 0, std::cos(radians)}, 1}.Normal(camera, centre);
  };
  EXPECT_TRUE(IsPlausible(camera, centre, leaning(70)));
  EXPECT_FALSE(IsPlausible(camera, centre, leaning(80)));
  EXPECT_FALSE(IsPlausible(camera, centre, {NAN, 0}));
}

TEST(NormalInOther, IsOfTheSamePlane) {
  const CameraModel camera = SmallCamera();
  const Case world;
  PatchNormal in_a = UnknownNormal(camera, kPixel);
  in_a.value = world.in_a.Normal(camera, kPixel);
  const auto in_b = NormalInOther(camera, kOther.rotation(), kPixel, in_a, world.pixel_b);
  ASSERT_TRUE(in_b.has_value());
  const Eigen::Vector2d truth = world.in_b.Normal(camera, world.pixel_b);
  EXPECT_LT((in_b->value - truth).norm() * camera.fx, 1e-9);
  EXPECT_GT((in_a.value - truth).norm() * camera.fx, 0.1);  // it does turn
}

TEST(NormalInOther, KnowsAsMuchAsBefore) {
  const CameraModel camera = SmallCamera();
  const Case world;
  PatchNormal in_a{world.in_a.Normal(camera, kPixel), Eigen::Matrix2d::Zero()};
  in_a.information << 9e6, 2e6, 2e6, 4e6;
  const auto in_b = NormalInOther(camera, kOther.rotation(), kPixel, in_a, world.pixel_b);
  ASSERT_TRUE(in_b.has_value());
  // Chi2 of a normal that is a little off, seen from either camera.
  for (const Eigen::Vector2d& change : {Eigen::Vector2d(1e-6, 0), Eigen::Vector2d(-4e-7, 8e-7)}) {
    PatchNormal off = in_a;
    off.value += change;
    const auto off_b = NormalInOther(camera, kOther.rotation(), kPixel, off, world.pixel_b);
    ASSERT_TRUE(off_b.has_value());
    const Eigen::Vector2d change_b = off_b->value - in_b->value;
    const double chi2_a = change.dot(in_a.information * change);
    EXPECT_NEAR(change_b.dot(in_b->information * change_b), chi2_a, 0.01 * chi2_a);
  }
}

TEST(NormalInOther, IsNoneFromBehind) {
  const CameraModel camera = SmallCamera();
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  const PatchNormal facing = UnknownNormal(camera, centre);
  const auto seen_turned_by = [&](double degrees) {
    const Eigen::Quaterniond R = RotationExp({0, degrees * M_PI / 180, 0});
    return NormalInOther(camera, R, centre, facing, centre).has_value();
  };
  EXPECT_TRUE(seen_turned_by(60));
  EXPECT_FALSE(seen_turned_by(85));
  EXPECT_FALSE(seen_turned_by(150));
}

}  // namespace
}  // namespace mono3d::tracking
