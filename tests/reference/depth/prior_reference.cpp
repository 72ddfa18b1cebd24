// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/prior_reference.h"

#include <algorithm>
#include <cmath>

namespace mono3d::reference {
namespace {

constexpr std::array<std::array<int, 2>, 8> kPriorDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}}};

// Planes per fine pixel, from two points of the plane through (x, y, w) a fine pixel apart.
Eigen::Vector2d Slope(const Eigen::Vector3d& n, double x, double y, double w,
                      const PriorParams& params) {
  const auto ray = [&](double u, double v) {
    return Eigen::Vector3d((u - double(params.cx)) / double(params.fx),
                           (v - double(params.cy)) / double(params.fy), 1);
  };
  const double cosine = n.dot(ray(x, y));
  if (params.follow_normals == 0 || cosine > -0.05) return Eigen::Vector2d::Zero();
  // w is n . ray / c everywhere on the plane.
  const double step = double(params.inverse_depth_step);
  const Eigen::Vector2d slope(w * (n.dot(ray(x + 0.5, y)) / cosine - 1) / step,
                              w * (n.dot(ray(x, y + 0.5)) / cosine - 1) / step);
  return slope.cwiseMax(-1).cwiseMin(1);
}

}  // namespace

std::vector<FineRange> Prior(const std::vector<float>& coarse_depth,
                             const std::vector<Eigen::Vector3f>& coarse_normals,
                             const cv::Mat& grey, const PriorParams& params) {
  const int width = static_cast<int>(params.coarse_width_px);
  const int height = static_cast<int>(params.coarse_height_px);
  const auto plane_of = [&](double w) {
    return (w - double(params.inverse_depth)) / double(params.inverse_depth_step);
  };
  std::vector<FineRange> ranges;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      std::vector<double> around;
      for (int i = 0; i < 9; ++i) {
        const int row = std::clamp(y / 2 + i / 3 - 1, 0, height - 1);
        const int column = std::clamp(x / 2 + i % 3 - 1, 0, width - 1);
        const float w = coarse_depth[static_cast<std::size_t>(row * width + column)];
        if (w > 0) around.push_back(double(w));
      }
      const auto own = static_cast<std::size_t>(y / 2 * width + x / 2);
      double position = 0.5 * params.num_planes;
      double middle = position;
      double spread = 0;
      Eigen::Vector2d slope = Eigen::Vector2d::Zero();
      if (!around.empty()) {
        const auto [farthest, nearest] = std::minmax_element(around.begin(), around.end());
        spread = plane_of(*nearest) - plane_of(*farthest);
        middle = 0.5 * (plane_of(*farthest) + plane_of(*nearest));
        position = middle;
        if (coarse_depth[own] > 0) {
          const auto w = double(coarse_depth[own]);
          slope = Slope(coarse_normals[own].cast<double>(), x / 2, y / 2, w, params);
          position = plane_of(w);
        }
      }
      if (around.empty()) middle = position;
      const double centre = std::clamp(middle, position - 5, position + 5);
      FineRange range;
      range.first_plane = static_cast<int>(
          std::clamp(std::floor(centre - 7), 0.0, std::max(double(params.num_planes) - 16, 0.0)));
      range.narrow = !around.empty() && spread <= 2 && range.first_plane == std::floor(centre - 7);
      range.grey = grey.at<std::uint8_t>(y, x);
      for (std::size_t i = 0; i < kPriorDirections.size(); ++i) {
        const double jump = slope.x() * kPriorDirections[i][0] + slope.y() * kPriorDirections[i][1];
        range.jumps[i] = std::clamp(static_cast<int>(std::floor(jump + 0.5)), -8, 7);
      }
      ranges.push_back(range);
    }
  }
  return ranges;
}

}  // namespace mono3d::reference
