// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_adjustment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/camera_covariance.h"
#include "calibration/camera_problem.h"
#include "calibration/parameter_choice.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinImages = 3;
constexpr std::size_t kMinPoints = 50;
// Rounds of weights: the first residuals are those of a wrong camera. The last gain is less than a
// hundredth of what one standard deviation of a parameter costs.
constexpr std::array<double, 3> kMinGains = {1e-2, 1e-4, 1e-6};

void SolveAll(CameraProblem& problem) {
  for (const double min_gain : kMinGains) problem.Solve(min_gain);
}

}  // namespace

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

CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              std::span<const SparseModel> maps) {
  CameraAdjustment result;
  result.camera = start;
  CameraProblem problem(maps, start, prior);
  if (problem.num_images() < kMinImages || problem.num_points() < kMinPoints) return result;
  const ParameterVector prior_sigmas = PriorSigmas(prior);
  SolveAll(problem);
  const ParameterMatrix covariance = CameraCovariance(problem);
  const ParameterFlags is_determined = DeterminedParameters(covariance, prior_sigmas);
  const ParameterFlags is_like_prior = ParametersLikePrior(
      problem.parameters() - problem.prior(), covariance, problem.is_fixed(), kChi2At99);
  const ParameterFlags is_held = (!is_determined || is_like_prior) && !problem.is_fixed();
  if (is_held.any()) {
    problem.FixAtPrior(is_held);
    for (const double min_gain : {1e-4, 1e-6}) problem.Solve(min_gain);
  }
  result.camera = problem.camera();
  // The uncertainty is that with all free.
  result.covariance = WithPriorVariance(covariance, is_determined, prior_sigmas);
  result.is_determined = is_determined;
  result.sigma_px = problem.sigma_px();
  result.num_images = problem.num_images();
  result.num_points = problem.num_points();
  result.num_observations = problem.observations().size();
  result.residuals = problem.Residuals();
  return result;
}

double LargestUncertainty_px(const CameraModel& camera, const ParameterMatrix& covariance) {
  const ParameterVector parameters = ToParameters(camera);
  CameraModel linear = camera;
  linear.distortion = {};
  double largest = 0;
  for (const double x : {0., 0.5, 1.}) {
    for (const double y : {0., 0.5, 1.}) {
      const Eigen::Vector3d ray =
          linear.Unproject({x * (camera.width - 1), y * (camera.height - 1)});
      const Eigen::Vector2d pixel = ProjectDistorted(camera, ray);
      Eigen::Matrix<double, 2, kNumParameters> J;
      for (int i = 0; i < kNumParameters; ++i) {
        constexpr double kStep = 1e-6;
        ParameterVector moved = parameters;
        moved[i] += kStep;
        J.col(i) = (ProjectDistorted(WithParameters(camera, moved), ray) - pixel) / kStep;
      }
      largest = std::max(largest, std::sqrt((J * covariance * J.transpose()).trace()));
    }
  }
  return largest;
}

}  // namespace mono3d::calibration
