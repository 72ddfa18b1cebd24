// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"

namespace mono3d::calibration {

// The parameters of a camera as the adjustment varies them: log fx, log(fy / fx), cx, cy (px),
// the distortion (k1, k2 - k1^2, p1, p2, k3; of a fisheye lens k1 k2 k3 k4), and the readout time
// of a rolling shutter (s) by rows and by columns, of which one at most is not zero in the end.
// Logarithms, as focal lengths are known to a share of themselves.
//
// k2 less k1^2, as k2 grows with the square of k1 in the projections that lenses follow, near the
// axis 1.8 k1^2 (equidistant), 1.7 (equisolid), 2 (stereographic, division model), and 0.9 to 1.5
// when fitted to the field of an ordinary lens with k1 and k2 alone. So a lens of which only k1 is
// known has the most likely k2; and with k2 > 0.45 k1^2 the image nowhere folds back on itself.
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

// k2 of a Brown lens.
template <typename T>
T SecondRadial(const T* parameters) {
  return parameters[kK2] + parameters[kK1] * parameters[kK1];
}

ParameterVector ToParameters(const CameraModel& camera);
// Of the size of `camera`, with other parameters; of two readout times with the larger one.
CameraModel WithParameters(const CameraModel& camera, const ParameterVector& parameters);

// A pinhole camera with the field of view of the camera's image, as far as undistorted images show
// it: for rays that stand for that field.
CameraModel PinholeOfField(const CameraModel& camera);

// Of each parameter; 0: it is fixed.
ParameterVector PriorSigmas(const CameraPrior& prior);

}  // namespace mono3d::calibration
