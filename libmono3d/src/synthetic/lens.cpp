// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/lens.h"

#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix32d = Eigen::Matrix<double, 3, 2>;

[[noreturn]] void ThrowNotALens() {
  throw Error(ErrorParts{.what = "distortion coefficients do not describe a lens",
                         .where = "synthetic camera",
                         .expected = "one viewing direction for each pixel of the image",
                         .found = {}});
}

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
  ThrowNotALens();
}

struct FisheyeSight {
  Vector3d direction;   // of length 1
  Matrix32d per_point;  // by the distorted point
};

// `point`: in focal lengths from the principal point.
FisheyeSight FisheyeSightOf(const CameraModel& camera, const FisheyeAngles& angles,
                            const Vector2d& point) {
  FisheyeSight sight;
  const double radius = point.norm();
  if (radius == 0) {
    sight.direction = Vector3d::UnitZ();
    sight.per_point << Matrix2d::Identity(), 0, 0;
    return sight;
  }
  const std::optional<double> angle = angles.At(radius);
  if (!angle) ThrowNotALens();
  const double by_radius = 1 / FisheyeRadiusSlope(camera.distortion, *angle);
  const double sine = std::sin(*angle);
  const double cosine = std::cos(*angle);
  const Vector2d outwards = point / radius;
  sight.direction << sine * outwards, cosine;
  const Matrix2d radial = outwards * outwards.transpose();
  sight.per_point << cosine * by_radius * radial + sine / radius * (Matrix2d::Identity() - radial),
      -sine * by_radius * outwards.transpose();
  return sight;
}

}  // namespace

Lens::Lens(const CameraModel& camera) : width_(static_cast<std::size_t>(camera.width)) {
  sights_.resize(width_ * static_cast<std::size_t>(camera.height));
  if (camera.lens == LensModel::kFisheye) {
    FindFisheye(camera);
  } else {
    FindBrown(camera);
  }
}

void Lens::FindFisheye(const CameraModel& camera) {
  const FisheyeAngles angles(camera.distortion);
  const Vector2d pixels_to_point(1 / camera.fx, 1 / camera.fy);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const FisheyeSight sight =
          FisheyeSightOf(camera, angles, camera.Unproject(Vector2d(x, y)).head<2>());
      At(x, y) = {sight.direction.cast<float>(),
                  (sight.per_point * pixels_to_point.asDiagonal()).cast<float>()};
    }
  }
}

void Lens::FindBrown(const CameraModel& camera) {
  const Vector2d pixels_to_point(1 / camera.fx, 1 / camera.fy);
  Vector2d p = Vector2d::Zero();
  for (int y = 0; y < camera.height; ++y) {
    // To and fro, so that the pixel before is always the one beside.
    for (int i = 0; i < camera.width; ++i) {
      const int x = y % 2 == 0 ? i : camera.width - 1 - i;
      if (x == 0 && y == 0) p = camera.Unproject({0, 0}).head<2>();
      p = Undistort(camera, camera.Unproject(Vector2d(x, y)).head<2>(), p);
      const Matrix2d per_point = Distort(camera.distortion, p).jacobian.inverse();
      PixelSight& sight = At(x, y);
      sight.direction << p.cast<float>(), 1;
      sight.per_pixel << (per_point * pixels_to_point.asDiagonal()).cast<float>(), 0, 0;
    }
  }
}

}  // namespace mono3d::synthetic
