// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/ground_map.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {
namespace {

constexpr float kCell_m = 0.5F;
constexpr float kDistanceOfNothing_m = 1000;

float DistanceFromSegment(const Eigen::Vector2f& p, const Eigen::Vector2f& a,
                          const Eigen::Vector2f& b) {
  const Eigen::Vector2f ab = b - a;
  const float t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12F), 0.0F, 1.0F);
  return (p - a - t * ab).norm();
}

}  // namespace

Grid::Grid(double half_extent_m, float cell_m,
           const std::function<float(const Eigen::Vector2f&)>& at)
    : half_extent_m_(static_cast<float>(half_extent_m)), cell_m_(cell_m) {
  const int size = static_cast<int>(std::ceil(2 * half_extent_m_ / cell_m)) + 1;
  values_.create(size, size, CV_32FC1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      values_.at<float>(y, x) = at({static_cast<float>(x) * cell_m - half_extent_m_,
                                    static_cast<float>(y) * cell_m - half_extent_m_});
    }
  }
}

DistanceField::DistanceField(std::span<const Polyline> lines, double half_extent_m, float reach_m)
    : Grid(half_extent_m, kCell_m, [&](const Eigen::Vector2f&) { return reach_m; }) {
  for (const Polyline& line : lines) {
    for (std::size_t i = 1; i < line.size(); ++i) Lower(line[i - 1], line[i], reach_m);
  }
}

// Takes the segment from a to b into account.
void DistanceField::Lower(const Eigen::Vector2f& a, const Eigen::Vector2f& b, float reach_m) {
  const auto cell_of = [&](float coordinate_m) {
    const float cell = (coordinate_m + half_extent_m_) / cell_m_;
    return std::clamp(static_cast<int>(cell), 0, values_.cols - 1);
  };
  const Eigen::Vector2f low = a.cwiseMin(b) - Eigen::Vector2f::Constant(reach_m);
  const Eigen::Vector2f high = a.cwiseMax(b) + Eigen::Vector2f::Constant(reach_m);
  for (int y = cell_of(low.y()); y <= cell_of(high.y()); ++y) {
    for (int x = cell_of(low.x()); x <= cell_of(high.x()); ++x) {
      const Eigen::Vector2f p(static_cast<float>(x) * cell_m_ - half_extent_m_,
                              static_cast<float>(y) * cell_m_ - half_extent_m_);
      float& nearest_m = values_.at<float>(y, x);
      nearest_m = std::min(nearest_m, DistanceFromSegment(p, a, b));
    }
  }
}

float Grid::At(const Eigen::Vector2f& p_m) const {
  if (values_.empty()) return kDistanceOfNothing_m;
  const float limit = static_cast<float>(values_.cols) - 1.001F;
  const float x = std::clamp((p_m.x() + half_extent_m_) / cell_m_, 0.0F, limit);
  const float y = std::clamp((p_m.y() + half_extent_m_) / cell_m_, 0.0F, limit);
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const auto* row0 = values_.ptr<float>(iy);
  const auto* row1 = values_.ptr<float>(iy + 1);
  const float top = row0[ix] + fx * (row0[ix + 1] - row0[ix]);
  const float bottom = row1[ix] + fx * (row1[ix + 1] - row1[ix]);
  return top + fy * (bottom - top);
}

bool IsAtWater(const GroundMap& ground, const Eigen::Vector2f& p_m, float within_m) {
  return !ground.water.IsEmpty() && ground.water.At(p_m) < ground.water_half_width_m + within_m;
}

}  // namespace mono3d::synthetic
