// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/normals_reference.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace mono3d::reference {
namespace {

constexpr int kRadius = 3;
constexpr Eigen::Index kMinSupport = 4;

// Rows (dx, dy, 1) and values of the pixels on the surface of (x, y).
void CollectSurface(const std::vector<float>& inverse_depth, const NormalsParams& params, int x,
                    int y, Eigen::MatrixX3d* rows, Eigen::VectorXd* values) {
  const int width = static_cast<int>(params.width_px);
  const int height = static_cast<int>(params.height_px);
  const float middle = inverse_depth[static_cast<std::size_t>(y * width + x)];
  Eigen::Index n = 0;
  rows->resize(9, 3);
  values->resize(9);
  for (int dy = -kRadius; dy <= kRadius; dy += kRadius) {
    for (int dx = -kRadius; dx <= kRadius; dx += kRadius) {
      const int column = x + dx;
      const int row = y + dy;
      if (column < 0 || column >= width || row < 0 || row >= height) continue;
      const float w = inverse_depth[static_cast<std::size_t>(row * width + column)];
      const auto reach = static_cast<float>(std::max({std::abs(dx), std::abs(dy), 1}));
      if (w <= 0 || std::abs(w - middle) > params.tolerance * reach) continue;
      rows->row(n) << dx, dy, 1;
      (*values)(n++) = w;
    }
  }
  rows->conservativeResize(n, 3);
  values->conservativeResize(n);
}

}  // namespace

std::vector<Eigen::Vector3f> Normals(const std::vector<float>& inverse_depth,
                                     const NormalsParams& params) {
  std::vector<Eigen::Vector3f> normals;
  Eigen::Matrix3d K;
  K << params.fx, 0, params.cx, 0, params.fy, params.cy, 0, 0, 1;
  for (int y = 0; y < static_cast<int>(params.height_px); ++y) {
    for (int x = 0; x < static_cast<int>(params.width_px); ++x) {
      normals.emplace_back(Eigen::Vector3f::Zero());
      if (inverse_depth[normals.size() - 1] <= 0) continue;
      Eigen::MatrixX3d rows;
      Eigen::VectorXd values;
      CollectSurface(inverse_depth, params, x, y, &rows, &values);
      if (rows.rows() < kMinSupport) continue;
      const Eigen::Vector3d g = rows.colPivHouseholderQr().solve(values);
      // w = g . (dx, dy, 1) = (g_x, g_y, g_0 - g_x x - g_y y) . (u, v, 1) = n . K^-1 (u, v, 1).
      const Eigen::Vector3d n =
          K.transpose() * Eigen::Vector3d(g.x(), g.y(), g.z() - g.x() * x - g.y() * y);
      if (n.z() > 0) normals.back() = -n.normalized().cast<float>();
    }
  }
  return normals;
}

}  // namespace mono3d::reference
