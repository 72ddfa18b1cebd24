// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"

namespace MONO3D_EXPORT mono3d {

// The pixel at which a lens with distortion shows a point. The same as CameraModel::Project where
// there is none.
// - kBrown (Brown 1971, k1 k2 p1 p2 k3 in OpenCV's order): z forward must be positive.
// - kFisheye (Kannala and Brandt 2006, as cv::fisheye has it): at FisheyeRadius of the angle
// between
//   the ray and the axis. Any point but the camera's own centre and those straight behind it.
Eigen::Vector2d ProjectDistorted(const CameraModel& camera, const Eigen::Vector3d& p_cam);

// Its inverse: the ray at z = 1 that a lens shows at a pixel, also outside its image; nothing where
// none is found, as the distortion folds back there, or looks sideways.
std::optional<Eigen::Vector3d> UnprojectDistorted(const CameraModel& camera,
                                                  const Eigen::Vector2d& pixel);

// Of a ray at the angle theta (rad) to the axis of a fisheye lens, in focal lengths from the
// principal point: theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
double FisheyeRadius(const std::array<double, 5>& distortion, double theta);
// Its derivative by theta: not positive where the lens folds back.
double FisheyeRadiusSlope(const std::array<double, 5>& distortion, double theta);

// The inverse of FisheyeRadius, from the axis to where the lens folds back or looks backwards.
class FisheyeAngles {
 public:
  explicit FisheyeAngles(const std::array<double, 5>& distortion);

  // The angle (rad) at which a ray has the radius; nothing where no ray has.
  std::optional<double> At(double radius) const;
  double largest() const { return kStep_rad * static_cast<double>(radii_.size() - 1); }

 private:
  static constexpr double kStep_rad = 0.01;

  std::array<double, 5> distortion_;
  std::vector<double> radii_;  // of the multiples of kStep_rad, ascending
};

}  // namespace mono3d
