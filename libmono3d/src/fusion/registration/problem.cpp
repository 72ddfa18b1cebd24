// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fusion/surfel.h"
#include "fusion/view.h"
#include "gpu/recorder.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// Of those that may be in view, an evaluation looks at no more surfels than this on the finest
// level; four times fewer are enough on each coarser one. Of 768x448 pixels that is a dozen to each
// independent measurement (kPixelsPerMeasurement).
constexpr std::uint32_t kMaxSamples = 65'536;

Vector7d PriorInformation(const RegistrationProblem& problem) {
  const RegistrationOptions& options = problem.options.registration;
  const double rotation = options.prior_px / problem.focal_px;
  const double translation_su = rotation * problem.median_depth_su;
  Vector7d sigma;
  sigma << Eigen::Vector3d::Constant(rotation), Eigen::Vector3d::Constant(translation_su),
      options.prior_scale;
  return sigma.cwiseAbs2().cwiseInverse();
}

}  // namespace

double MedianDepth(const DepthMap& map) {
  constexpr int kStep = 7;  // every 49th pixel: thousands of any usable map
  std::vector<float> depths;
  for (int y = 0; y < map.depth.rows; y += kStep) {
    for (int x = 0; x < map.depth.cols; x += kStep) {
      const float z = map.depth.at<float>(y, x);
      if (z > 0 && std::isfinite(z)) depths.push_back(z);
    }
  }
  return UpperMedianOrZero(std::move(depths));
}

RegistrationProblem MakeProblem(const DepthMap& map, const SurfelMapOptions& options,
                                const Similarity& predicted_S_world_kf) {
  return {map, options, predicted_S_world_kf, MedianDepth(map),
          std::min(map.camera.fx, map.camera.fy)};
}

// Motion of the image, in pixels, of a motion of the camera.
double ImageMotion(const RegistrationProblem& problem, const Vector7d& step) {
  return problem.focal_px *
         std::hypot(step.head<3>().norm(), step.segment<3>(3).norm() / problem.median_depth_su);
}

// From the prediction to `S_world_kf`, as the unknowns of one step.
Vector7d Deviation(const RegistrationProblem& problem, const Similarity& S_world_kf) {
  const Similarity moved = S_world_kf.Inverse() * problem.predicted_S_world_kf;
  Vector7d deviation;
  deviation << RotationLog(moved.pose().rotation()), moved.pose().translation() / moved.scale(),
      -std::log(moved.scale());
  return deviation;
}

// The model moves in the camera's frame, and becomes smaller where the depths are to be larger.
Similarity Moved(const Similarity& S_world_kf, const Vector7d& step) {
  const Similarity shrunk(std::exp(-step(6)), Pose());
  const Similarity moved(1, Pose(RotationExp(step.head<3>()), step.segment<3>(3)));
  return (shrunk * moved * S_world_kf.Inverse()).Inverse();
}

RegisterParams MakeRegisterParams(const RegistrationProblem& problem, std::uint32_t num_surfels,
                                  std::uint32_t num_blocks, int level) {
  const ViewParams same = MakeViewParams(problem.map, problem.options, num_surfels, 0);
  RegisterParams params{};
  params.width_px = same.width_px;
  params.height_px = same.height_px;
  params.fx = same.fx;
  params.fy = same.fy;
  params.cx = same.cx;
  params.cy = same.cy;
  params.inverse_depth_sigma = same.inverse_depth_sigma;
  params.relative_sigma = same.relative_sigma;
  params.association_sigmas = std::ldexp(same.association_sigmas, level);
  params.min_normal_cosine = same.min_normal_cosine;
  params.num_surfels = num_surfels;
  params.num_blocks = num_blocks;
  const std::uint32_t max_samples = kMaxSamples >> static_cast<unsigned>(2 * level);
  params.stride =
      std::max(DivideRoundingUp(std::uint64_t{num_blocks} * kSurfelsPerBlock, max_samples), 1U);
  params.grey_level = static_cast<std::uint32_t>(level);
  params.grey_noise = static_cast<float>(problem.options.registration.grey_noise);
  params.grey_shift_px = static_cast<float>(problem.options.registration.grey_shift_px);
  return params;
}

// Exposure drifts from map to map: mean and contrast of what both see are made equal.
void SetExposure(RegisterParams& params, const RegistrationSystem& system) {
  params.grey_gain = 0;
  if (static_cast<double>(system.num_grey) < kPixelsPerMeasurement ||
      system.surfel_grey_sigma < params.grey_noise || system.image_grey_sigma < params.grey_noise) {
    return;
  }
  params.grey_gain = static_cast<float>(system.image_grey_sigma / system.surfel_grey_sigma);
  params.grey_bias =
      static_cast<float>(system.image_grey_mean - params.grey_gain * system.surfel_grey_mean);
  // Of the difference half is the image's own, half that of the surfels' colours, which the gain
  // magnifies.
  params.grey_noise *= std::sqrt(0.5F * (1 + params.grey_gain * params.grey_gain));
}

namespace {

// Sampled residuals stand for `stride` each, and hold as much as independent ones among them.
double IndependentShare(std::uint32_t stride) {
  return std::min(1.0, stride / kPixelsPerMeasurement);
}

// A plane or a grey wall leaves motions along it open: there the prior alone holds.
Matrix7d Information(const RegistrationProblem& problem, const RegistrationSystem& system,
                     std::uint32_t stride) {
  Matrix7d information = IndependentShare(stride) * system.information;
  information.diagonal() += PriorInformation(problem);
  if (!problem.options.registration.with_scale) {
    information.row(6).setZero();
    information.col(6).setZero();
    information(6, 6) = 1;
  }
  return information;
}

// Rotations, lengths and logarithms have units of their own: what is solved has a unit diagonal.
Vector7d UnitDiagonal(const Matrix7d& information) {
  return information.diagonal().cwiseSqrt().cwiseInverse();
}

}  // namespace

// The step of Gauss and Newton, with the prior.
Vector7d Solve(const RegistrationProblem& problem, const RegistrationSystem& system,
               const Similarity& S_world_kf, std::uint32_t stride) {
  const Matrix7d information = Information(problem, system, stride);
  Vector7d gradient = IndependentShare(stride) * system.gradient;
  gradient += PriorInformation(problem).cwiseProduct(Deviation(problem, S_world_kf));
  if (!problem.options.registration.with_scale) gradient(6) = 0;
  const Vector7d unit = UnitDiagonal(information);
  const Matrix7d scaled = unit.asDiagonal() * information * unit.asDiagonal();
  return -unit.cwiseProduct(scaled.ldlt().solve(unit.cwiseProduct(gradient)));
}

double Uncertainty_px(const RegistrationProblem& problem, const RegistrationSystem& system,
                      std::uint32_t stride) {
  const Matrix7d information = Information(problem, system, stride);
  const Vector7d unit = UnitDiagonal(information);
  const Matrix7d scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Vector7d variance =
      unit.cwiseAbs2().cwiseProduct(scaled.ldlt().solve(Matrix7d::Identity()).diagonal());
  Vector7d sigma = variance.cwiseMax(0.0).cwiseSqrt();
  return ImageMotion(problem, sigma);
}

double Misfit(const RegistrationSystem& system, const Vector7d& step) {
  const auto count = static_cast<double>(system.num_agree + system.num_grey);
  if (count == 0) return 0;
  return std::sqrt(std::max(0.0, step.dot(system.information * step)) / count);
}

}  // namespace mono3d
