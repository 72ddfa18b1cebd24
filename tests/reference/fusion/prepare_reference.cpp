// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

constexpr int kRadius = 3;
constexpr int kMinSamples = 6;

// Least squares for relative inverse depth = a + b u + c v, in double and by the normal equations.
Vector3f FittedNormal(const ViewParams& view, const PackedDepthMap& map, int x, int y,
                      const Vector3f& ray) {
  const int width = static_cast<int>(view.width_px);
  const int height = static_cast<int>(view.height_px);
  const float centre = 1 / map.depth[static_cast<std::size_t>(y * width + x)];
  const float noise = 3 * 1.41421356F * InverseDepthSigma(view, centre);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (int dv = -kRadius; dv <= kRadius; ++dv) {
    for (int du = -kRadius; du <= kRadius; ++du) {
      if (x + du < 0 || y + dv < 0 || x + du >= width || y + dv >= height) continue;
      const float z = map.depth[static_cast<std::size_t>((y + dv) * width + x + du)];
      const float slope = view.max_slope_per_px * centre;
      const auto steps = static_cast<float>(std::abs(du) + std::abs(dv));
      if (z <= 0 || std::abs(1 / z - centre) > noise + slope * steps) continue;
      const Eigen::Vector3d row(1, du, dv);
      normal_matrix += row * row.transpose();
      right_side += row * double{(1 / z - centre) / centre};
    }
  }
  const bool is_plane = normal_matrix(0, 0) >= kMinSamples && normal_matrix.determinant() > 0.5;
  if (!is_plane) return -ray;
  const Eigen::Vector3d abc = normal_matrix.ldlt().solve(right_side);
  const Eigen::Vector2d xy(view.fx * abc[1], view.fy * abc[2]);
  const double z = 1 + abc[0] - xy.dot(ray.head<2>().cast<double>());
  return -Eigen::Vector3d(xy.x(), xy.y(), z).cast<float>();
}

}  // namespace

Candidates Prepare(const ViewParams& view, const PackedDepthMap& map) {
  Candidates candidates(map.depth.size(), {0, 0, 0, 0});
  for (std::size_t i = 0; i < map.depth.size(); ++i) {
    const float confidence = map.normal_confidence[i][3];
    if (map.depth[i] <= 0 || confidence <= 0) continue;
    const int x = static_cast<int>(i % view.width_px);
    const int y = static_cast<int>(i / view.width_px);
    const Vector3f ray = Ray(view, static_cast<float>(x), static_cast<float>(y));
    Vector3f normal = Head(map.normal_confidence[i]);
    if (normal.dot(ray) >= 0) normal = FittedNormal(view, map, x, y, ray);
    normal.normalize();
    candidates[i] = {normal.x(), normal.y(), normal.z(), confidence};
  }
  return candidates;
}

}  // namespace mono3d::reference
