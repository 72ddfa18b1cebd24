// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/dense_schur_solver.h"
#include "tracking/optimisation/sparse_schur_solver.h"

namespace mono3d::tracking {
namespace {

// Of each observation; infinite behind the camera.
std::vector<double> Chi2(const BundleAdjustmentProblem& problem) {
  std::vector<Eigen::Matrix3d> rotations;
  for (const Pose& pose : problem.T_cam_world) {
    rotations.push_back(pose.rotation().toRotationMatrix());
  }
  std::vector<double> chi2;
  chi2.reserve(problem.observations.size());
  for (const BundleAdjustmentObservation& observation : problem.observations) {
    const Eigen::Vector3d p_cam = rotations[observation.view] * problem.p_world[observation.point] +
                                  problem.T_cam_world[observation.view].translation();
    const double squared = (problem.camera.Project(p_cam) - observation.pixel).squaredNorm();
    chi2.push_back(p_cam.z() > 0 ? squared / (observation.sigma_px * observation.sigma_px)
                                 : HUGE_VAL);
  }
  return chi2;
}

double RobustCost(const std::vector<double>& of_observations) {
  double cost = 0;
  for (const double chi2 : of_observations) {
    if (!std::isfinite(chi2)) continue;
    cost += chi2 <= kChi2TwoDof ? chi2 : 2 * std::sqrt(kChi2TwoDof * chi2) - kChi2TwoDof;
  }
  return cost;
}

std::vector<char> FindBeyond(const std::vector<double>& of_observations, double max_chi2) {
  std::vector<char> is_beyond;
  is_beyond.reserve(of_observations.size());
  for (const double chi2 : of_observations) is_beyond.push_back(chi2 <= max_chi2 ? 0 : 1);
  return is_beyond;
}

// One stage: moves the problem's poses and points, over the observations that are no outliers.
void Minimise(BundleAdjustmentProblem& problem, const std::vector<char>& is_outlier, bool robust,
              int num_steps, const BundleAdjustmentOptions& options) {
  // Up to here a dense matrix of the views is cheaper than looking for its zeros: with 240 views of
  // a room a third of the time, with 310 of a flight around a yard two fifths. At 400 one
  // factorisation takes half a second, and time grows with the third power.
  constexpr std::ptrdiff_t kMaxDenseViews = 400;
  const auto num_free = std::count(problem.is_fixed.begin(), problem.is_fixed.end(), 0);
  const auto minimise = num_free <= kMaxDenseViews ? MinimiseDensely : MinimiseSparsely;
  minimise(problem, is_outlier, robust, num_steps, options);
}

}  // namespace

BundleAdjustmentReport SolveBundleAdjustment(BundleAdjustmentProblem& problem,
                                             const BundleAdjustmentOptions& options) {
  BundleAdjustmentReport report;
  std::vector<double> chi2 = Chi2(problem);
  report.initial_cost = RobustCost(chi2);
  if (options.num_robust_steps > 0) {
    // Neither starts from a point behind a camera.
    constexpr double kMaxFinite = std::numeric_limits<double>::max();
    Minimise(problem, FindBeyond(chi2, kMaxFinite), true, options.num_robust_steps, options);
    chi2 = Chi2(problem);
  }
  if (options.num_steps > 0 && !options.IsStopped()) {
    Minimise(problem, FindBeyond(chi2, kChi2TwoDof), false, options.num_steps, options);
    chi2 = Chi2(problem);
  }
  report.is_outlier = FindBeyond(chi2, kChi2TwoDof);
  report.final_cost = RobustCost(chi2);
  return report;
}

}  // namespace mono3d::tracking
