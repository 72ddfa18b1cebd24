// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// When the lines of an image are read. A global shutter reads them all at once.
struct RollingShutter {
  // From the first line to the last; negative where the last one is read first (a camera that
  // hangs upside down).
  double readout_s = 0;
  // The lines are the columns, from left to right: the sensor is turned by 90 degrees.
  bool reads_columns = false;

  bool IsGlobal() const { return readout_s == 0; }
  bool operator==(const RollingShutter&) const = default;
};

// How a lens bends lines of sight.
enum class LensModel {
  kBrown,    // a pinhole with radial and tangential distortion: k1 k2 p1 p2 k3
  kFisheye,  // by the angle to the axis, also beyond 90 degrees: k1 k2 k3 k4
};

// "pinhole", "fisheye"
const char* ToString(LensModel lens);
// Of CameraModel::distortion: "k1", "k2", ...; four of a fisheye lens.
std::vector<std::string> DistortionNames(LensModel lens);

// The calibration of a camera, with the distortion of OpenCV; see ProjectDistorted.
// Pixel (0, 0) is the centre of the top-left pixel; camera axes are x right, y down, z forward.
struct CameraModel {
  int width = 0;                                       // px
  int height = 0;                                      // px
  double fx = 0;                                       // px
  double fy = 0;                                       // px
  double cx = 0;                                       // px
  double cy = 0;                                       // px
  std::array<double, 5> distortion = {0, 0, 0, 0, 0};  // of a fisheye lens the last one is 0
  RollingShutter shutter = {};
  LensModel lens = LensModel::kBrown;

  // A fisheye lens always has, also where its coefficients are 0.
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

  // The pinhole camera with the same focal lengths and principal point.
  CameraModel WithoutDistortion() const;

  // The camera of the image resized to the new size: c' = (c + 0.5) * s - 0.5, f' = f * s.
  CameraModel Resized(int new_width, int new_height) const;
};

// Where the line through a pixel of the sensor lies between the first (-0.5) and the last (0.5).
double LineShare(const CameraModel& sensor, const Eigen::Vector2d& pixel, bool is_column);

// Throws Error unless sizes and focal lengths are positive and every number is finite, and for a
// fifth coefficient of a fisheye lens. `where` names the origin of the calibration in the message.
void Validate(const CameraModel& camera, const std::string& where);

}  // namespace mono3d
