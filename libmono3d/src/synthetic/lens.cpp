// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/lens.h"

#include <Eigen/LU>
#include <cmath>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

struct Distorted {
  Vector2d point;
  Matrix2d jacobian;  // by the undistorted point
};

// The distortion of OpenCV and its derivative, both at z = 1.
Distorted Distort(const std::array<double, 5>& d, const Vector2d& p) {
  const auto& [k1, k2, p1, p2, k3] = d;
  const double x = p.x();
  const double y = p.y();
  const double r2 = p.squaredNorm();
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double radial_by_r2 = k1 + r2 * (2 * k2 + 3 * r2 * k3);
  Distorted out;
  out.point = {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
               y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  const double mixed = 2 * x * y * radial_by_r2 + 2 * p1 * x + 2 * p2 * y;
  out.jacobian << radial + 2 * x * x * radial_by_r2 + 2 * p1 * y + 6 * p2 * x, mixed,  //
      mixed, radial + 2 * y * y * radial_by_r2 + 6 * p1 * y + 2 * p2 * x;
  return out;
}

constexpr int kMaxSteps = 30;
constexpr double kConverged = 1e-12;  // of a coordinate at z = 1: 1e-9 px

// Newton's method from `start`, the answer of the pixel beside it.
Vector2d Undistort(const CameraModel& camera, const Vector2d& distorted, const Vector2d& start) {
  Vector2d p = start;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Distorted at = Distort(camera.distortion, p);
    if (!(at.jacobian.determinant() > 0)) break;
    const Vector2d change = at.jacobian.inverse() * (distorted - at.point);
    p += change;
    if (change.norm() < kConverged) return p;
  }
  throw Error(ErrorParts{.what = "distortion coefficients do not describe a lens",
                         .where = "synthetic camera",
                         .expected = "one viewing direction for each pixel of the image",
                         .found = {}});
}

}  // namespace

Lens::Lens(const CameraModel& camera) : width_(static_cast<std::size_t>(camera.width)) {
  sights_.resize(width_ * static_cast<std::size_t>(camera.height));
  const Vector2d pixels_to_point(1 / camera.fx, 1 / camera.fy);
  Vector2d p = Vector2d::Zero();
  for (int y = 0; y < camera.height; ++y) {
    // To and fro, so that the pixel before is always the one beside.
    for (int i = 0; i < camera.width; ++i) {
      const int x = y % 2 == 0 ? i : camera.width - 1 - i;
      if (x == 0 && y == 0) p = camera.Unproject({0, 0}).head<2>();
      p = Undistort(camera, camera.Unproject(Vector2d(x, y)).head<2>(), p);
      PixelSight& sight =
          sights_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
      sight.point = p.cast<float>();
      const Matrix2d per_point = Distort(camera.distortion, p).jacobian.inverse();
      sight.per_pixel = (per_point * pixels_to_point.asDiagonal()).cast<float>();
    }
  }
}

}  // namespace mono3d::synthetic
