// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"

namespace mono3d::calibration {

// The parameters of a camera as the adjustment varies them: log fx, log(fy / fx), cx, cy (px),
// k1 k2 p1 p2 k3, and the readout time of a rolling shutter (s) by rows and by columns, of which
// one at most is not zero in the end. Logarithms, as focal lengths are known to a share of
// themselves.
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
  kReadoutByColumns
};
using ParameterVector = Eigen::Matrix<double, kNumParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kNumParameters, kNumParameters>;
using ParameterFlags = Eigen::Array<bool, kNumParameters, 1>;

ParameterVector ToParameters(const CameraModel& camera);
// Of the size of `camera`, with other parameters; of two readout times with the larger one.
CameraModel WithParameters(const CameraModel& camera, const ParameterVector& parameters);

// Of each parameter; 0: it is fixed.
ParameterVector PriorSigmas(const CameraPrior& prior);

}  // namespace mono3d::calibration
