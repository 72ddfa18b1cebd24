// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/ground_map.h"

#include <algorithm>
#include <cmath>

namespace mono3d::synthetic {
namespace {

constexpr float kCell_m = 0.5F;
constexpr float kFarAway_m = 1000;

float DistanceFromSegment(const Eigen::Vector2f& p, const Eigen::Vector2f& a,
                          const Eigen::Vector2f& b) {
  const Eigen::Vector2f ab = b - a;
  const float t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12F), 0.0F, 1.0F);
  return (p - a - t * ab).norm();
}

float DistanceFromLines(const Eigen::Vector2f& p, std::span<const Polyline> lines) {
  float nearest_m = kFarAway_m;
  for (const Polyline& line : lines) {
    for (std::size_t i = 1; i < line.size(); ++i) {
      nearest_m = std::min(nearest_m, DistanceFromSegment(p, line[i - 1], line[i]));
    }
  }
  return nearest_m;
}

}  // namespace

DistanceField::DistanceField(std::span<const Polyline> lines, double half_extent_m)
    : half_extent_m_(static_cast<float>(half_extent_m)) {
  const int size = static_cast<int>(std::ceil(2 * half_extent_m_ / kCell_m)) + 1;
  distance_m_.create(size, size, CV_32FC1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector2f p(static_cast<float>(x) * kCell_m - half_extent_m_,
                              static_cast<float>(y) * kCell_m - half_extent_m_);
      distance_m_.at<float>(y, x) = DistanceFromLines(p, lines);
    }
  }
}

float DistanceField::At(const Eigen::Vector2f& p_m) const {
  if (distance_m_.empty()) return kFarAway_m;
  const float limit = static_cast<float>(distance_m_.cols) - 1.001F;
  const float x = std::clamp((p_m.x() + half_extent_m_) / kCell_m, 0.0F, limit);
  const float y = std::clamp((p_m.y() + half_extent_m_) / kCell_m, 0.0F, limit);
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const auto* row0 = distance_m_.ptr<float>(iy);
  const auto* row1 = distance_m_.ptr<float>(iy + 1);
  const float top = row0[ix] + fx * (row0[ix + 1] - row0[ix]);
  const float bottom = row1[ix] + fx * (row1[ix + 1] - row1[ix]);
  return top + fy * (bottom - top);
}

}  // namespace mono3d::synthetic
