// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_posterior.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace mono3d::calibration {

bool IsFarFrom(const CameraPrior& prior, const CameraModel& camera) {
  constexpr double kSignificant = 3;  // in sigmas: beyond chance
  const ParameterVector sigmas = PriorSigmas(prior);
  const ParameterVector difference = ToParameters(camera) - ToParameters(prior.camera);
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    if (sigmas[i] > 0 && std::abs(difference[i]) > kSignificant * sigmas[i]) return true;
  }
  return false;
}

CameraPrior WithoutWeight(const CameraPrior& prior) {
  CameraPrior result =
      DefaultCameraPrior(prior.camera.width, prior.camera.height, prior.camera.lens);
  result.camera = prior.camera;
  return result;
}

CameraPrior WithLensHeld(const CameraPrior& prior) {
  CameraPrior result = prior;
  result.focal_sigma = result.aspect_sigma = result.principal_point_sigma_px = 0;
  result.distortion_sigma = {};
  return result;
}

void TakeLens(const CameraPrior& told, CameraModel& camera) {
  const RollingShutter shutter = camera.shutter;
  camera = told.camera;
  camera.shutter = shutter;
}

void TakeLens(const CameraPrior& told, CameraPrior& posterior) {
  const double readout_sigma_s = posterior.readout_sigma_s;
  CameraModel camera = posterior.camera;
  TakeLens(told, camera);
  posterior = told;
  posterior.camera = camera;
  posterior.readout_sigma_s = readout_sigma_s;
}

CameraAdjustment WithDifference(CameraAdjustment adjustment, const CameraAdjustment& before) {
  const ParameterVector difference = adjustment.is_determined.select(
      ToParameters(adjustment.camera) - ToParameters(before.camera), ParameterVector::Zero());
  adjustment.covariance += 0.5 * difference * difference.transpose();
  return adjustment;
}

void TakePosterior(const CameraAdjustment& adjustment, CameraCalibration& result) {
  const ParameterVector sigmas = adjustment.covariance.diagonal().cwiseSqrt();
  const ParameterFlags& is_determined = adjustment.is_determined;
  CameraPrior& posterior = result.posterior;
  posterior.camera = adjustment.camera;
  posterior.focal_sigma = sigmas[kLogFocal];
  posterior.aspect_sigma = sigmas[kLogAspect];
  posterior.principal_point_sigma_px = std::max(sigmas[kCx], sigmas[kCy]);
  result.determines_focal_length = is_determined[kLogFocal];
  result.determines_aspect = is_determined[kLogAspect];
  result.determines_principal_point = is_determined[kCx] && is_determined[kCy];
  for (std::size_t i = 0; i < posterior.distortion_sigma.size(); ++i) {
    const auto parameter = kK1 + static_cast<Eigen::Index>(i);
    posterior.distortion_sigma[i] = sigmas[parameter];
    result.determines_distortion[i] = is_determined[parameter];
  }
  if (posterior.camera.lens == LensModel::kBrown) {
    // Of k2 itself.
    const Eigen::Vector2d by_parameters(2 * posterior.camera.distortion[0], 1);
    posterior.distortion_sigma[1] =
        std::sqrt(by_parameters.dot(adjustment.covariance.block<2, 2>(kK1, kK1) * by_parameters));
  }
  // Of a global shutter by the lines that the images tell of, if any.
  const bool is_by_columns =
      posterior.camera.shutter.IsGlobal()
          ? !is_determined[kReadoutByRows] && is_determined[kReadoutByColumns]
          : posterior.camera.shutter.reads_columns;
  const Parameter readout = is_by_columns ? kReadoutByColumns : kReadoutByRows;
  result.determines_readout = is_determined[readout];
  // The adjustment takes the errors of velocities for independent. As they come from differences of
  // poses, which fall short of a shake of some hertz by this share, they are not.
  constexpr double kVelocityError = 0.01;
  posterior.readout_sigma_s =
      std::hypot(sigmas[readout], kVelocityError * posterior.camera.shutter.readout_s);
  result.uncertainty_px = LargestUncertainty_px(adjustment.camera, adjustment.covariance);
  result.sigma_px = adjustment.sigma_px;
  result.num_images = static_cast<int>(adjustment.num_images);
  result.num_points = static_cast<int>(adjustment.num_points);
  result.num_positions = static_cast<int>(adjustment.num_positions);
  result.variation = adjustment.variation;
  result.residuals = adjustment.residuals;
}

std::vector<CameraPositions> PositionsOf(const std::vector<SparseModel>& maps,
                                         const PositionsOfMap& positions) {
  std::vector<CameraPositions> all;
  if (!positions) return all;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    std::optional<CameraPositions> of_map = positions(maps[i]);
    if (!of_map) continue;
    of_map->map_id = static_cast<int>(i);
    all.push_back(std::move(*of_map));
  }
  return all;
}

void BringToSize(const CameraPrior& told, CameraCalibration& result) {
  const double scale = static_cast<double>(told.camera.width) / result.prior.camera.width;
  result.prior = told;
  result.posterior =
      result.is_learned ? result.posterior.Resized(told.camera.width, told.camera.height) : told;
  result.change_px *= scale;
  result.uncertainty_px *= scale;
  result.sigma_px *= scale;
  result.variation.principal_point_px *= scale;
  for (CalibrationResidual& residual : result.residuals) {
    residual.pixel = scale * (residual.pixel.array() + 0.5) - 0.5;
    residual.error_px *= scale;
  }
}

}  // namespace mono3d::calibration
