// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/camera_covariance.h"
#include "calibration/camera_problem.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinImages = 3;
constexpr std::size_t kMinPoints = 50;
// Rounds of weights: the first residuals are those of a wrong camera. The last gain is less than a
// hundredth of what one standard deviation of a parameter costs.
constexpr std::array<double, 3> kMinGains = {1e-2, 1e-4, 1e-6};
// What an adjustment says of a parameter counts where it knows twice as much as the prior did;
// below that the estimate follows what the model leaves out (real lenses, rolling shutters).
constexpr double kMaxShareOfPriorSigma = 0.5;
// Chi-square at 99 %, for one and two degrees of freedom: beyond chance.
constexpr std::array<double, 2> kChi2At99 = {6.63, 9.21};

// Parameters that are held together: without one of a pair the other has no meaning.
using ParameterGroup = std::vector<Eigen::Index>;

void SolveAll(CameraProblem& problem) {
  for (const double min_gain : kMinGains) problem.Solve(min_gain);
}

// How far the group lies from the prior, as a share of what chance allows.
double Significance(const ParameterGroup& group, const ParameterVector& difference,
                    const ParameterMatrix& covariance) {
  const Eigen::VectorXd of_group = difference(group);
  const Eigen::MatrixXd its_covariance = covariance(group, group);
  return of_group.dot(its_covariance.ldlt().solve(of_group)) / kChi2At99[group.size() - 1];
}

// Backward elimination: which free parameters the images do not tell from the prior's. Each one
// that is left free for nothing makes the others less certain, and follows what the model leaves
// out. Higher terms go before lower ones that mean something without them.
ParameterFlags NotTold(const CameraProblem& problem, ParameterMatrix covariance) {
  std::vector<ParameterGroup> groups = {{kK3}, {kK2}, {kP1, kP2}, {kCx, kCy}, {kK1}, {kLogAspect}};
  std::erase_if(groups,
                [&](const ParameterGroup& group) { return problem.is_fixed()[group.front()]; });
  ParameterFlags held = ParameterFlags::Constant(false);
  ParameterVector difference = problem.parameters() - problem.prior();
  while (!groups.empty()) {
    std::vector<double> significance;
    for (const ParameterGroup& group : groups) {
      significance.push_back(Significance(group, difference, covariance));
    }
    const auto least = std::min_element(significance.begin(), significance.end());
    if (*least > 1) break;
    const auto position = least - significance.begin();
    const ParameterGroup group = groups[static_cast<std::size_t>(position)];
    groups.erase(groups.begin() + position);
    for (const Eigen::Index i : group) held[i] = true;
    // The others, given that these are the prior's.
    const Eigen::MatrixXd gain =
        covariance(Eigen::all, group) *
        covariance(group, group)
            .eval()
            .ldlt()
            .solve(Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(group.size()),
                                             static_cast<Eigen::Index>(group.size())));
    difference -= gain * difference(group).eval();
    covariance -= (gain * covariance(group, Eigen::all)).eval();
  }
  return held;
}

}  // namespace

CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              std::span<const SparseModel> maps) {
  CameraAdjustment result;
  result.camera = start;
  CameraProblem problem(maps, start, prior);
  if (problem.num_images() < kMinImages || problem.num_points() < kMinPoints) return result;
  const ParameterVector prior_sigmas = PriorSigmas(prior);
  SolveAll(problem);
  ParameterMatrix covariance = CameraCovariance(problem);
  const ParameterFlags is_determined =
      covariance.diagonal().array().sqrt() < kMaxShareOfPriorSigma * prior_sigmas.array();
  const ParameterFlags is_held =
      (!is_determined || NotTold(problem, covariance)) && !problem.is_fixed();
  if (is_held.any()) {
    problem.FixAtPrior(is_held);
    for (const double min_gain : {1e-4, 1e-6}) problem.Solve(min_gain);
  }
  // What is held where the prior has it is not known better for that: the uncertainty is that with
  // all free.
  for (int i = 0; i < kNumParameters; ++i) {
    if (is_determined[i] || prior_sigmas[i] == 0) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = prior_sigmas[i] * prior_sigmas[i];
  }
  result.camera = problem.camera();
  result.covariance = covariance;
  result.is_determined = is_determined;
  result.sigma_px = problem.sigma_px();
  result.num_images = problem.num_images();
  result.num_points = problem.num_points();
  result.num_observations = problem.observations().size();
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
