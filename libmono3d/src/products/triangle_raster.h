// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/types.hpp>

namespace mono3d {

// Calls draw(x, y, shares) for each pixel of an image whose centre lies in the triangle or on its
// edge; the point there is the corners in these shares. Corners run either way round.
template <typename Draw>
void RasteriseTriangle(const std::array<Eigen::Vector2f, 3>& corners, const cv::Size& image,
                       Draw&& draw) {
  const Eigen::Vector2f ab = corners[1] - corners[0];
  const Eigen::Vector2f ac = corners[2] - corners[0];
  const float doubled_area = ab.x() * ac.y() - ab.y() * ac.x();
  if (doubled_area == 0 || !std::isfinite(doubled_area)) return;
  const auto [left, right] = std::minmax({corners[0].x(), corners[1].x(), corners[2].x()});
  const auto [top, bottom] = std::minmax({corners[0].y(), corners[1].y(), corners[2].y()});
  // A triangle that is nowhere near the image has corners that no int takes.
  if (right < 0 || bottom < 0) return;
  if (left > static_cast<float>(image.width - 1) || top > static_cast<float>(image.height - 1)) {
    return;
  }
  const int first_x = static_cast<int>(std::ceil(std::max(left, 0.F)));
  const int first_y = static_cast<int>(std::ceil(std::max(top, 0.F)));
  const int last_x =
      static_cast<int>(std::floor(std::min(right, static_cast<float>(image.width - 1))));
  const int last_y =
      static_cast<int>(std::floor(std::min(bottom, static_cast<float>(image.height - 1))));
  // A pixel on an edge belongs to both sides, whatever the rounding.
  constexpr float kEdge = -1e-4F;
  for (int y = first_y; y <= last_y; ++y) {
    for (int x = first_x; x <= last_x; ++x) {
      const Eigen::Vector2f ap =
          Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y)) - corners[0];
      const float b = (ap.x() * ac.y() - ap.y() * ac.x()) / doubled_area;
      const float c = (ab.x() * ap.y() - ab.y() * ap.x()) / doubled_area;
      const float a = 1 - b - c;
      if (a < kEdge || b < kEdge || c < kEdge) continue;
      draw(x, y, Eigen::Vector3f(a, b, c));
    }
  }
}

}  // namespace mono3d
