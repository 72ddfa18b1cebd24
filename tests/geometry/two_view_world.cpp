// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/two_view_world.h"

#include <cmath>
#include <numbers>

namespace mono3d {

TwoViewWorld MakeTwoViewWorld(const TwoViewWorldOptions& options, std::mt19937& random) {
  TwoViewWorld world;
  world.T_b_a = Pose(RotationExp({0.02, -0.11, 0.03}), Eigen::Vector3d(1.4, 0.2, 0.3));
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.4, 1).normalized();
  const auto noise = [&] {
    return Eigen::Vector2d(Normal(random, options.noise_px), Normal(random, options.noise_px));
  };
  while (static_cast<int>(world.pairs.size()) < options.num_points) {
    const Eigen::Vector2d a(Uniform(random, 0, 767), Uniform(random, 0, 447));
    const Eigen::Vector3d ray = world.camera.Unproject(a);
    const double depth = options.planar ? 12 / normal.dot(ray) : Uniform(random, 8, 20);
    const Eigen::Vector3d p_a = depth * ray;
    const Eigen::Vector2d b = world.camera.Project(world.T_b_a * p_a);
    if (!world.camera.Contains(b)) continue;
    const bool is_outlier = static_cast<int>(world.pairs.size()) < options.num_outliers;
    world.p_a.push_back(p_a);
    world.pairs.push_back({a + noise(), b + noise()});
    if (is_outlier) {
      world.pairs.back().b = {Uniform(random, 0, 767), Uniform(random, 0, 447)};
    }
  }
  return world;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

double RotationErrorDeg(const Pose& a, const Pose& b) {
  return (a.Inverse() * b).RotationAngle() * 180 / std::numbers::pi;
}

}  // namespace mono3d
