// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_parameters.h"

#include <cmath>
#include <cstddef>

namespace mono3d::calibration {

ParameterVector ToParameters(const CameraModel& camera) {
  ParameterVector parameters;
  parameters << std::log(camera.fx), std::log(camera.fy / camera.fx), camera.cx, camera.cy,
      camera.distortion[0], camera.distortion[1], camera.distortion[2], camera.distortion[3],
      camera.distortion[4];
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
  return result;
}

ParameterVector PriorSigmas(const CameraPrior& prior) {
  ParameterVector sigmas;
  sigmas << prior.focal_sigma, prior.aspect_sigma, prior.principal_point_sigma_px,
      prior.principal_point_sigma_px, prior.distortion_sigma[0], prior.distortion_sigma[1],
      prior.distortion_sigma[2], prior.distortion_sigma[3], prior.distortion_sigma[4];
  return sigmas;
}

}  // namespace mono3d::calibration
