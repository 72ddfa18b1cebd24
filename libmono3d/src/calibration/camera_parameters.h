// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"

namespace mono3d::calibration {

// The parameters of a camera as the adjustment varies them: log fx, log(fy / fx), cx, cy (px),
// the distortion (k1 k2 p1 p2 k3; in the places of p1 and p2 the k3 and k4 of a fisheye lens), and
// the readout time of a rolling shutter (s) by rows and by columns, of which one at most is not
// zero in the end. Logarithms, as focal lengths are known to a share of themselves.
constexpr int kNumParameters = 11;
enum Parameter {
  kLogFocal,
  kLogAspect,
  kCx,
  kCy,
  kK1,
  kK2,
  kP1,
  kP2,
  kK3,
  kReadoutByRows,
  kReadoutByColumns,
  kFisheyeK3 = kP1,
  kFisheyeK4 = kP2,
};
using ParameterVector = Eigen::Matrix<double, kNumParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kNumParameters, kNumParameters>;
using ParameterFlags = Eigen::Array<bool, kNumParameters, 1>;

ParameterVector ToParameters(const CameraModel& camera);
// Of the size of `camera`, with other parameters; of two readout times with the larger one.
CameraModel WithParameters(const CameraModel& camera, const ParameterVector& parameters);

// A pinhole camera with the field of view of the camera's image, as far as undistorted images show
// it: for rays that stand for that field.
CameraModel PinholeOfField(const CameraModel& camera);

// Of each parameter; 0: it is fixed.
ParameterVector PriorSigmas(const CameraPrior& prior);

}  // namespace mono3d::calibration
