// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "calibration/board_problem.h"
#include "calibration/board_start.h"
#include "calibration/parameter_choice.h"
#include "mono3d/core/statistics.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinViews = 3;
constexpr double kBadView = 3;  // times the median error of a view
constexpr int kNumPoseParameters = 6;

// What one view says of the camera once its own pose is free: information and gradient, in px.
struct ViewInformation {
  ParameterMatrix information = ParameterMatrix::Zero();
  ParameterVector gradient = ParameterVector::Zero();
};

ViewInformation InformationOf(const BoardProblem& problem, std::size_t index,
                              const ParameterFlags& is_held) {
  const BoardErrors errors = ErrorsOf(problem.camera, problem.views[index], problem.poses[index]);
  const Eigen::MatrixXd by_pose = errors.by_pose;
  Eigen::MatrixXd by_camera = errors.by_camera;
  for (int i = 0; i < kNumParameters; ++i) {
    if (is_held[i]) by_camera.col(i).setZero();
  }
  const auto pose_information = (by_pose.transpose() * by_pose).eval().ldlt();
  const Eigen::MatrixXd free =
      by_camera - by_pose * pose_information.solve(by_pose.transpose() * by_camera);
  return {free.transpose() * by_camera, free.transpose() * errors.observed_less_computed};
}

double ResidualVariance(const BoardProblem& problem, int num_parameters) {
  std::size_t num_coordinates = 0;
  for (const BoardView& view : problem.views) num_coordinates += 2 * view.pixels.size();
  const double num_unknowns =
      static_cast<double>(kNumPoseParameters * problem.views.size()) + num_parameters;
  // A coordinate cannot be measured better than this: interpolation of 8-bit images.
  constexpr double kMinSigma_px = 0.01;
  return std::max(
      kMinSigma_px * kMinSigma_px,
      SumOfSquares(problem) / std::max(1., static_cast<double>(num_coordinates) - num_unknowns));
}

// What all views and the prior say; in sigmas. Rows of what is held are those of the unit matrix.
struct BoardInformation {
  ParameterMatrix information = ParameterMatrix::Zero();
  ParameterVector gradient = ParameterVector::Zero();
  ParameterMatrix spread = ParameterMatrix::Zero();  // sum of squares of the views' gradients

  ParameterMatrix Covariance(const ParameterFlags& is_held) const {
    ParameterMatrix covariance = information.ldlt().solve(ParameterMatrix::Identity());
    for (int i = 0; i < kNumParameters; ++i) {
      if (!is_held[i]) continue;
      covariance.row(i).setZero();
      covariance.col(i).setZero();
    }
    return covariance;
  }
};

BoardInformation InformationOfAll(const BoardProblem& problem, const ParameterFlags& is_held) {
  const double variance =
      ResidualVariance(problem, kNumParameters - static_cast<int>(is_held.count()));
  BoardInformation result;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const ViewInformation view = InformationOf(problem, i, is_held);
    result.information += view.information / variance;
    result.gradient += view.gradient / variance;
    result.spread += view.gradient * view.gradient.transpose() / (variance * variance);
  }
  const ParameterVector sigmas = PriorSigmas(problem.prior);
  const ParameterVector to_prior =
      ToParameters(problem.prior.camera) - ToParameters(problem.camera);
  for (int i = 0; i < kNumParameters; ++i) {
    const double weight = is_held[i] ? 0 : 1 / (sigmas[i] * sigmas[i]);
    result.information(i, i) += is_held[i] ? 1 : weight;
    result.gradient[i] += weight * to_prior[i];
  }
  return result;
}

// Draws the camera to the prior, and what is held onto it. Returns whether that makes a camera.
bool SolveWithPrior(const ParameterFlags& is_held, BoardProblem& problem) {
  constexpr int kMaxSteps = 20;
  constexpr double kMinStep = 1e-6;  // squared, in sigmas
  problem.camera = WithParameters(problem.camera, is_held.select(ToParameters(problem.prior.camera),
                                                                 ToParameters(problem.camera)));
  for (int i = 0; i < kMaxSteps; ++i) {
    SolvePoses(problem);
    const BoardInformation all = InformationOfAll(problem, is_held);
    const ParameterVector step = all.Covariance(is_held) * all.gradient;
    problem.camera = WithParameters(problem.camera, ToParameters(problem.camera) + step);
    if (!IsPlausible(problem.camera)) return false;
    if (step.dot(all.information * step) < kMinStep) break;
  }
  SolvePoses(problem);
  return true;
}

ParameterMatrix BoardCovariance(const BoardProblem& problem, const ParameterFlags& is_held) {
  const BoardInformation all = InformationOfAll(problem, is_held);
  const ParameterMatrix covariance = all.Covariance(is_held);
  // 1 where the errors of a view are independent; the gradients sum up to nothing, which takes one
  // view of freedom.
  const auto num_views = static_cast<double>(problem.views.size());
  const auto num_free = static_cast<double>(kNumParameters - is_held.count());
  const double overdispersion =
      (covariance * all.spread).trace() / num_free * num_views / (num_views - 1);
  return std::max(1., overdispersion) * covariance;
}

// The covariance when each parameter that is not determined is only as certain as the prior, and
// the others follow it as the views ask for.
ParameterMatrix WithPriorOfUndetermined(const ParameterMatrix& covariance,
                                        const ParameterFlags& is_determined,
                                        const ParameterVector& prior_sigmas) {
  std::vector<Eigen::Index> open;
  for (Eigen::Index i = 0; i < kNumParameters; ++i) {
    if (!is_determined[i] && prior_sigmas[i] > 0) open.push_back(i);
  }
  if (open.empty()) return covariance;
  const Eigen::MatrixXd of_open = covariance(open, open);
  const Eigen::MatrixXd by_open =
      of_open.ldlt().solve(Eigen::MatrixXd(covariance(open, Eigen::all))).transpose();
  const Eigen::MatrixXd prior = prior_sigmas(open).array().square().matrix().asDiagonal();
  return covariance + by_open * (prior - of_open) * by_open.transpose();
}

// Returns whether it left any out.
bool LeaveOutBadViews(BoardProblem& problem) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const BoardErrors of_view = ErrorsOf(problem.camera, problem.views[i], problem.poses[i]);
    errors.push_back(std::sqrt(of_view.observed_less_computed.squaredNorm() /
                               static_cast<double>(problem.views[i].pixels.size())));
  }
  const double limit = kBadView * Median(errors);
  std::vector<BoardView> good;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    if (errors[i] <= limit) good.push_back(problem.views[i]);
  }
  const bool has_bad = good.size() < problem.views.size();
  problem.views = std::move(good);
  return has_bad;
}

// Until no view is bad. Returns whether that makes a camera.
bool SolveWithGoodViews(const ParameterFlags& is_fixed, BoardProblem& problem) {
  constexpr int kMaxRounds = 5;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (problem.views.size() < kMinViews) return false;
    if (!FindStart(problem)) return false;
    const bool is_fisheye = problem.camera.lens == LensModel::kFisheye;
    if (is_fisheye && !SolveWithPrior(is_fixed, problem)) return false;
    if (!LeaveOutBadViews(problem)) return true;
  }
  return false;
}

// Do the views fit as well with another focal length? Of boards that all face the camera the
// covariance at the least residual does not tell: which one that is, is a matter of rounding.
bool LeavesFocalLengthOpen(const BoardProblem& found, const ParameterFlags& is_fixed) {
  if (is_fixed[kLogFocal]) return false;
  constexpr double kOther = 0.3;            // the logarithm: what a camera of chance differs by
  constexpr double kLeastChi2Gain = 10.83;  // one degree of freedom, 99.9 %
  const double variance =
      ResidualVariance(found, kNumParameters - static_cast<int>(is_fixed.count()));
  ParameterFlags is_held = is_fixed;
  is_held[kLogFocal] = true;
  for (const double factor : {std::exp(kOther), std::exp(-kOther)}) {
    BoardProblem other = found;
    other.camera.fx = other.prior.camera.fx = factor * found.camera.fx;
    other.camera.fy = factor * found.camera.fy;
    other.prior.camera.fy = other.camera.fy;
    if (!SolveWithPrior(is_held, other)) continue;
    if (SumOfSquares(other) - SumOfSquares(found) < kLeastChi2Gain * variance) return true;
  }
  return false;
}

void TakeCounts(const BoardProblem& problem, int num_parameters, CameraAdjustment& result) {
  result.camera = problem.camera;
  result.sigma_px = std::sqrt(ResidualVariance(problem, num_parameters));
  result.num_images = problem.views.size();
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const std::vector<CalibrationResidual> residuals = ResidualsOf(problem, i);
    result.residuals.insert(result.residuals.end(), residuals.begin(), residuals.end());
    result.num_points = std::max(result.num_points, problem.views[i].corners.size());
  }
  result.num_observations = result.residuals.size();
}

}  // namespace

CameraAdjustment AdjustBoardCamera(CameraPrior prior, std::span<const BoardView> views) {
  prior.readout_sigma_s = 0;  // boards are held still, their images stand alone
  CameraAdjustment result;
  result.camera = prior.camera;
  const ParameterVector prior_sigmas = PriorSigmas(prior);
  const ParameterFlags is_fixed = prior_sigmas.array() == 0;
  BoardProblem problem{prior, {views.begin(), views.end()}, prior.camera};
  if (!SolveWithGoodViews(is_fixed, problem) || !SolveWithPrior(is_fixed, problem)) return result;
  const ParameterMatrix covariance = BoardCovariance(problem, is_fixed);
  const ParameterFlags is_determined = DeterminedParameters(covariance, prior_sigmas);
  if (!is_determined[kLogFocal] || LeavesFocalLengthOpen(problem, is_fixed)) return result;
  const ParameterVector difference = ToParameters(problem.camera) - ToParameters(prior.camera);
  const ParameterFlags is_held =
      is_fixed || !is_determined ||
      ParametersLikePrior(prior.camera.lens, difference, covariance, is_fixed, kChi2OfAkaike);
  if (is_held.any() && !SolveWithPrior(is_held, problem)) return result;
  TakeCounts(problem, kNumParameters - static_cast<int>(is_held.count()), result);
  result.covariance = WithPriorOfUndetermined(covariance, is_determined, prior_sigmas);
  result.is_determined = is_determined;
  return result;
}

}  // namespace mono3d::calibration
