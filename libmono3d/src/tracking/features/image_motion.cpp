// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/image_motion.h"

#include <Eigen/Geometry>
#include <cstddef>
#include <utility>

#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::tracking {

ImageMotion::ImageMotion(const CameraModel& camera, const CameraModel& sensor,
                         std::vector<Neighbour> neighbours)
    : camera_(camera), sensor_(sensor), neighbours_(std::move(neighbours)) {}

double ImageMotion::LineTime_s(const Eigen::Vector2d& pixel) const {
  return ShutterMotion(sensor_, {}).Time_s(camera_.Unproject(pixel));
}

Eigen::Vector2d ImageMotion::AtMiddleLine(const Eigen::Vector2d& pixel) const {
  if (neighbours_.empty()) return pixel;
  const double line_s = LineTime_s(pixel);
  // Of each neighbour: how much later it shows the same, and how far away.
  struct Step {
    double later_s = 0;
    Eigen::Vector2d way;
  };
  std::vector<Step> steps;
  for (const Neighbour& neighbour : neighbours_) {
    const Eigen::Vector2d other = (neighbour.H_other_here * pixel.homogeneous()).hnormalized();
    steps.push_back({neighbour.later_s + LineTime_s(other) - line_s, other - pixel});
  }
  // Lagrange's polynomial through (0, 0) and the steps, at the time of the middle line.
  Eigen::Vector2d way = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    double weight = -line_s / steps[i].later_s;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (k == i) continue;
      weight *= (-line_s - steps[k].later_s) / (steps[i].later_s - steps[k].later_s);
    }
    way += weight * steps[i].way;
  }
  return way.allFinite() ? pixel + way : pixel;
}

}  // namespace mono3d::tracking
