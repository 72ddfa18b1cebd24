// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/camera_model.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {

const char* ToString(LensModel lens) { return lens == LensModel::kFisheye ? "fisheye" : "pinhole"; }

std::vector<std::string> DistortionNames(LensModel lens) {
  if (lens == LensModel::kFisheye) return {"k1", "k2", "k3", "k4"};
  return {"k1", "k2", "p1", "p2", "k3"};
}

bool CameraModel::HasDistortion() const {
  return lens == LensModel::kFisheye ||
         std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0; });
}

bool CameraModel::Contains(const Eigen::Vector2d& pixel, double border) const {
  return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width - 1 - border &&
         pixel.y() <= height - 1 - border;
}

Eigen::Matrix3d CameraModel::Matrix() const {
  Eigen::Matrix3d K;
  K << fx, 0, cx, 0, fy, cy, 0, 0, 1;
  return K;
}

CameraModel CameraModel::WithoutDistortion() const {
  CameraModel pinhole = *this;
  pinhole.lens = LensModel::kBrown;
  pinhole.distortion = {};
  return pinhole;
}

CameraModel CameraModel::Resized(int new_width, int new_height) const {
  const double scale_x = static_cast<double>(new_width) / width;
  const double scale_y = static_cast<double>(new_height) / height;
  CameraModel resized = *this;  // distortion works on directions and stays
  resized.width = new_width;
  resized.height = new_height;
  resized.fx = fx * scale_x;
  resized.fy = fy * scale_y;
  resized.cx = (cx + 0.5) * scale_x - 0.5;
  resized.cy = (cy + 0.5) * scale_y - 0.5;
  return resized;
}

double LineShare(const CameraModel& sensor, const Eigen::Vector2d& pixel, bool is_column) {
  return (is_column ? pixel.x() / (sensor.width - 1) : pixel.y() / (sensor.height - 1)) - 0.5;
}

void Validate(const CameraModel& camera, const std::string& where) {
  const auto require = [&](bool holds, const char* name, const char* expected, double found) {
    if (holds) return;
    throw Error(ErrorParts{.what = std::string("camera calibration: bad ") + name,
                           .where = where,
                           .expected = expected,
                           .found = std::to_string(found)});
  };
  require(camera.width > 0, "image_width", "a positive number", camera.width);
  require(camera.height > 0, "image_height", "a positive number", camera.height);
  const bool fx_ok = std::isfinite(camera.fx) && camera.fx > 0;
  const bool fy_ok = std::isfinite(camera.fy) && camera.fy > 0;
  require(fx_ok, "focal length fx", "a positive number", camera.fx);
  require(fy_ok, "focal length fy", "a positive number", camera.fy);
  require(std::isfinite(camera.cx), "principal point cx", "a finite number", camera.cx);
  require(std::isfinite(camera.cy), "principal point cy", "a finite number", camera.cy);
  for (const double k : camera.distortion) {
    require(std::isfinite(k), "distortion coefficient", "a finite number", k);
  }
  const bool has_fifth = camera.lens == LensModel::kFisheye && camera.distortion[4] != 0;
  require(!has_fifth, "fifth coefficient of a fisheye lens", "0", camera.distortion[4]);
  constexpr double kMaxReadout_s = 1;  // slower ones are scanners
  const double readout_s = camera.shutter.readout_s;
  require(std::abs(readout_s) <= kMaxReadout_s, "readout time", "-1 to 1 s", readout_s);
}

}  // namespace mono3d
