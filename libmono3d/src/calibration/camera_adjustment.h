// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

// The parameters of a camera as the adjustment varies them: log fx, log(fy / fx), cx, cy (px),
// k1 k2 p1 p2 k3. Logarithms, as focal lengths are known to a share of themselves.
constexpr int kNumParameters = 9;
enum Parameter { kLogFocal, kLogAspect, kCx, kCy, kK1, kK2, kP1, kP2, kK3 };
using ParameterVector = Eigen::Matrix<double, kNumParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kNumParameters, kNumParameters>;
using ParameterFlags = Eigen::Array<bool, kNumParameters, 1>;

ParameterVector ToParameters(const CameraModel& camera);
// Of the size of `camera`, with other parameters.
CameraModel WithParameters(const CameraModel& camera, const ParameterVector& parameters);

// Of each parameter; 0: it is fixed.
ParameterVector PriorSigmas(const CameraPrior& prior);

struct CameraAdjustment {
  CameraModel camera;
  // Posterior, of the parameters. Zero rows for those that are fixed; those that the images do not
  // determine have their prior variance.
  ParameterMatrix covariance = ParameterMatrix::Zero();
  ParameterFlags is_determined = ParameterFlags::Constant(false);  // by the images
  double sigma_px = 0;  // robust standard deviation of an observed coordinate
  std::size_t num_images = 0;
  std::size_t num_points = 0;
  std::size_t num_observations = 0;  // 0: nothing was adjusted
  std::vector<CalibrationResidual> residuals;
};

// Bundle adjustment of the poses and points of `maps` and of their one camera, which starts at
// `start` and is drawn to `prior`. The pixels of the maps are those of the images as taken. A
// parameter whose posterior sigma is not below half of its prior's stays where the prior has it,
// and so does a distortion that differs from the prior's by no more than chance. With fewer than
// three images or fifty points of three observations nothing is adjusted.
//
// The covariance is the clustered sandwich estimate (Cameron, Gelbach, Miller 2011), over points
// and over stretches of the footage: the errors of one point in neighbouring images are not
// independent, nor are those of neighbouring images, so that the inverse of the information would
// be too small.
CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              std::span<const SparseModel> maps);

// The standard deviation in px of where the camera shows a ray, at its largest over the image.
double LargestUncertainty_px(const CameraModel& camera, const ParameterMatrix& covariance);

}  // namespace mono3d::calibration
