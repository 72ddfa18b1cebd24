// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// The calibration of a pinhole camera with the distortion of OpenCV (k1 k2 p1 p2 k3).
// Pixel (0, 0) is the centre of the top-left pixel; camera axes are x right, y down, z forward.
struct CameraModel {
  int width = 0;   // px
  int height = 0;  // px
  double fx = 0;   // px
  double fy = 0;   // px
  double cx = 0;   // px
  double cy = 0;   // px
  std::array<double, 5> distortion = {0, 0, 0, 0, 0};

  bool HasDistortion() const;
  bool operator==(const CameraModel&) const = default;

  // Without distortion: z forward must be positive.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_cam) const {
    return {fx * p_cam.x() / p_cam.z() + cx, fy * p_cam.y() / p_cam.z() + cy};
  }
  // Without distortion: the point at z = 1 on the ray of a pixel.
  Eigen::Vector3d Unproject(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1};
  }
  // Is the pixel inside the image, at least `border` px from the outermost pixel centres?
  bool Contains(const Eigen::Vector2d& pixel, double border = 0) const;
  Eigen::Matrix3d Matrix() const;  // K

  // The camera of the image resized to the new size: c' = (c + 0.5) * s - 0.5, f' = f * s.
  CameraModel Resized(int new_width, int new_height) const;
};

// Throws Error unless sizes and focal lengths are positive and every number is finite. `where`
// names the origin of the calibration in the message.
void Validate(const CameraModel& camera, const std::string& where);

}  // namespace mono3d
