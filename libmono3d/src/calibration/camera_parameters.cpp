// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_parameters.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mono3d/geometry/distortion.h"
#include "mono3d/image/undistorter.h"

namespace mono3d::calibration {

ParameterVector ToParameters(const CameraModel& camera) {
  ParameterVector parameters;
  const RollingShutter& shutter = camera.shutter;
  parameters << std::log(camera.fx), std::log(camera.fy / camera.fx), camera.cx, camera.cy,
      camera.distortion[0], camera.distortion[1], camera.distortion[2], camera.distortion[3],
      camera.distortion[4], shutter.reads_columns ? 0 : shutter.readout_s,
      shutter.reads_columns ? shutter.readout_s : 0;
  if (camera.lens == LensModel::kBrown) parameters[kK2] -= parameters[kK1] * parameters[kK1];
  return parameters;
}

CameraModel WithParameters(const CameraModel& camera, const ParameterVector& parameters) {
  CameraModel result = camera;
  result.fx = std::exp(parameters[kLogFocal]);
  result.fy = std::exp(parameters[kLogFocal] + parameters[kLogAspect]);
  result.cx = parameters[kCx];
  result.cy = parameters[kCy];
  for (std::size_t i = 0; i < result.distortion.size(); ++i) {
    result.distortion[i] = parameters[kK1 + static_cast<int>(i)];
  }
  if (camera.lens == LensModel::kBrown) result.distortion[1] = SecondRadial(parameters.data());
  const bool reads_columns =
      std::abs(parameters[kReadoutByColumns]) > std::abs(parameters[kReadoutByRows]);
  result.shutter = {parameters[reads_columns ? kReadoutByColumns : kReadoutByRows], reads_columns};
  return result;
}

CameraModel PinholeOfField(const CameraModel& camera) {
  CameraModel pinhole = camera.WithoutDistortion();
  if (camera.lens != LensModel::kFisheye) return pinhole;
  const double x = std::max(camera.cx, camera.width - 1 - camera.cx) / camera.fx;
  const double y = std::max(camera.cy, camera.height - 1 - camera.cy) / camera.fy;
  const double radius = std::hypot(x, y);  // of the farthest corner, in focal lengths
  const FisheyeAngles angles(camera.distortion);
  const double angle =
      std::min(angles.At(radius).value_or(angles.largest()), Undistorter::kMaxFisheyeAngle_rad);
  const double scale = radius / std::tan(angle);
  pinhole.fx *= scale;
  pinhole.fy *= scale;
  return pinhole;
}

ParameterVector PriorSigmas(const CameraPrior& prior) {
  // Where the shutter is known, so is which way it reads.
  const RollingShutter& shutter = prior.camera.shutter;
  const double by_rows = shutter.reads_columns ? 0 : prior.readout_sigma_s;
  const double by_columns = shutter.IsGlobal() || shutter.reads_columns ? prior.readout_sigma_s : 0;
  ParameterVector sigmas;
  sigmas << prior.focal_sigma, prior.aspect_sigma, prior.principal_point_sigma_px,
      prior.principal_point_sigma_px, prior.distortion_sigma[0], prior.distortion_sigma[1],
      prior.distortion_sigma[2], prior.distortion_sigma[3], prior.distortion_sigma[4], by_rows,
      by_columns;
  return sigmas;
}

}  // namespace mono3d::calibration
