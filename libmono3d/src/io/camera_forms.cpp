// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/camera_forms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace mono3d {
namespace {

// The optional numbers of keys named `prefix` + k1 and so on.
void TakeNamedDistortion(const CalibrationYaml& yaml, const std::string& prefix,
                         CameraModel& camera) {
  const std::vector<std::string> names = DistortionNames(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    camera.distortion.at(i) = yaml.FindNumber(prefix + names[i]).value_or(0);
  }
}

// Refuses what the lens model has no place for.
void RefuseFurtherDistortion(const CalibrationYaml& yaml, const std::string& prefix,
                             const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (yaml.FindNumber(prefix + name).value_or(0) == 0) continue;
    yaml.Throw(yaml.Line(prefix + name), "unsupported distortion", name + " = 0",
               *yaml.Find(prefix + name), ErrorCode::kUnsupported);
  }
}

void RequireCount(const CalibrationYaml& yaml, const std::string& key, std::size_t found,
                  std::size_t expected) {
  if (found == expected) return;
  yaml.Throw(yaml.Line(key), "wrong number of values in " + key, std::to_string(expected),
             std::to_string(found));
}

}  // namespace

std::optional<CameraModel> ParseKalibr(const CalibrationYaml& yaml) {
  if (!yaml.Has("cam0.intrinsics")) return std::nullopt;
  if (yaml.Has("cam1.intrinsics")) {
    yaml.Throw(yaml.Line("cam1"), "several cameras in one file", "cam0 alone", "cam1");
  }
  const std::string model = yaml.Find("cam0.camera_model").value_or("pinhole");
  if (model != "pinhole") {
    yaml.Throw(yaml.Line("cam0.camera_model"), "unsupported camera model", "pinhole", model,
               ErrorCode::kUnsupported);
  }
  const std::string lens = yaml.Find("cam0.distortion_model").value_or("none");
  if (lens != "radtan" && lens != "equidistant" && lens != "none") {
    yaml.Throw(yaml.Line("cam0.distortion_model"), "unsupported distortion model",
               "radtan or equidistant", lens, ErrorCode::kUnsupported);
  }
  CameraModel camera;
  camera.lens = lens == "equidistant" ? LensModel::kFisheye : LensModel::kBrown;
  const std::vector<double> intrinsics = yaml.Matrix("cam0.intrinsics");
  RequireCount(yaml, "cam0.intrinsics", intrinsics.size(), 4);
  camera.fx = intrinsics[0];
  camera.fy = intrinsics[1];
  camera.cx = intrinsics[2];
  camera.cy = intrinsics[3];
  const std::vector<double> size = yaml.Matrix("cam0.resolution");
  RequireCount(yaml, "cam0.resolution", size.size(), 2);
  constexpr double kMaxSize = 1e6;
  for (const double length : size) {
    if (length >= 1 && length <= kMaxSize && length == std::floor(length)) continue;
    yaml.Throw(yaml.Line("cam0.resolution"), "bad resolution", "positive whole numbers",
               std::to_string(length));
  }
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  if (lens == "none" || !yaml.Has("cam0.distortion_coeffs")) return camera;
  const std::vector<double> distortion = yaml.Matrix("cam0.distortion_coeffs");
  RequireCount(yaml, "cam0.distortion_coeffs", distortion.size(), 4);
  std::ranges::copy(distortion, camera.distortion.begin());
  return camera;
}

std::optional<CameraModel> ParseOrbSlam(const CalibrationYaml& yaml) {
  const bool is_new = yaml.Has("camera1.fx");
  if (!is_new && !yaml.Has("camera.fx")) return std::nullopt;
  const std::string prefix = is_new ? "camera1." : "camera.";
  const std::string type = yaml.Find("camera.type").value_or("PinHole");
  if (type != "PinHole" && type != "Rectified" && type != "KannalaBrandt8") {
    yaml.Throw(yaml.Line("camera.type"), "unsupported camera model", "PinHole or KannalaBrandt8",
               type, ErrorCode::kUnsupported);
  }
  CameraModel camera;
  camera.lens = type == "KannalaBrandt8" ? LensModel::kFisheye : LensModel::kBrown;
  camera.width = yaml.Size("camera.width");
  camera.height = yaml.Size("camera.height");
  camera.fx = yaml.Number(prefix + "fx");
  camera.fy = yaml.Number(prefix + "fy");
  camera.cx = yaml.Number(prefix + "cx");
  camera.cy = yaml.Number(prefix + "cy");
  TakeNamedDistortion(yaml, prefix, camera);
  return camera;
}

std::optional<CameraModel> ParseNerfstudio(const CalibrationYaml& yaml) {
  const bool has_focal = yaml.Has("fl_x");
  if (!has_focal && !yaml.Has("camera_angle_x")) return std::nullopt;
  const std::string model = yaml.Find("camera_model").value_or("OPENCV");
  const std::array<std::string, 6> known = {"OPENCV",         "OPENCV_FISHEYE", "PINHOLE",
                                            "SIMPLE_PINHOLE", "SIMPLE_RADIAL",  "RADIAL"};
  if (std::ranges::find(known, model) == known.end()) {
    yaml.Throw(yaml.Line("camera_model"), "unsupported camera model", "OPENCV or OPENCV_FISHEYE",
               model, ErrorCode::kUnsupported);
  }
  constexpr double kHalfOfPixel = 0.5;
  CameraModel camera;
  camera.lens = model == "OPENCV_FISHEYE" ? LensModel::kFisheye : LensModel::kBrown;
  camera.width = yaml.Size("w");
  camera.height = yaml.Size("h");
  camera.fx = has_focal ? yaml.Number("fl_x")
                        : 0.5 * camera.width / std::tan(0.5 * yaml.Number("camera_angle_x"));
  camera.fy = yaml.FindNumber("fl_y").value_or(camera.fx);
  camera.cx = yaml.FindNumber("cx").value_or(0.5 * camera.width) - kHalfOfPixel;
  camera.cy = yaml.FindNumber("cy").value_or(0.5 * camera.height) - kHalfOfPixel;
  TakeNamedDistortion(yaml, "", camera);
  if (camera.lens == LensModel::kBrown) RefuseFurtherDistortion(yaml, "", {"k4", "k5", "k6"});
  return camera;
}

}  // namespace mono3d
