// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/parameter_choice.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace mono3d::calibration {
namespace {

constexpr double kMaxShareOfPriorSigma = 0.5;

// Parameters that are held together: without one of a pair the other has no meaning.
using ParameterGroup = std::vector<Eigen::Index>;

// How far the group lies from the prior, as a share of the limit.
double Significance(const ParameterGroup& group, const ParameterVector& difference,
                    const ParameterMatrix& covariance, const Chi2Limits& limits) {
  const Eigen::VectorXd of_group = difference(group);
  const Eigen::MatrixXd its_covariance = covariance(group, group);
  return of_group.dot(its_covariance.ldlt().solve(of_group)) / limits[group.size() - 1];
}

std::vector<ParameterGroup> ParameterGroups(LensModel lens) {
  if (lens == LensModel::kFisheye) {
    return {{kFisheyeK4},     {kFisheyeK3},       {kK2}, {kCx, kCy}, {kK1}, {kLogAspect},
            {kReadoutByRows}, {kReadoutByColumns}};
  }
  return {{kK3}, {kK2},        {kP1, kP2},       {kCx, kCy},
          {kK1}, {kLogAspect}, {kReadoutByRows}, {kReadoutByColumns}};
}

}  // namespace

ParameterFlags DeterminedParameters(const ParameterMatrix& covariance,
                                    const ParameterVector& prior_sigmas) {
  return covariance.diagonal().array().sqrt() < kMaxShareOfPriorSigma * prior_sigmas.array();
}

ParameterFlags ParametersLikePrior(LensModel lens, ParameterVector difference,
                                   ParameterMatrix covariance, const ParameterFlags& is_fixed,
                                   const Chi2Limits& limits) {
  std::vector<ParameterGroup> groups = ParameterGroups(lens);
  std::erase_if(groups, [&](const ParameterGroup& group) { return is_fixed[group.front()]; });
  ParameterFlags held = ParameterFlags::Constant(false);
  while (!groups.empty()) {
    std::vector<double> significance;
    for (const ParameterGroup& group : groups) {
      significance.push_back(Significance(group, difference, covariance, limits));
    }
    const auto least = std::min_element(significance.begin(), significance.end());
    if (*least > 1) break;
    const auto position = least - significance.begin();
    const ParameterGroup group = groups[static_cast<std::size_t>(position)];
    groups.erase(groups.begin() + position);
    for (const Eigen::Index i : group) held[i] = true;
    // The others, given that these are the prior's.
    const auto size = static_cast<Eigen::Index>(group.size());
    const Eigen::MatrixXd gain =
        covariance(Eigen::all, group) *
        covariance(group, group).eval().ldlt().solve(Eigen::MatrixXd::Identity(size, size));
    difference -= gain * difference(group).eval();
    covariance -= (gain * covariance(group, Eigen::all)).eval();
  }
  return held;
}

ParameterMatrix WithPriorVariance(ParameterMatrix covariance, const ParameterFlags& is_determined,
                                  const ParameterVector& prior_sigmas) {
  for (int i = 0; i < kNumParameters; ++i) {
    if (is_determined[i] || prior_sigmas[i] == 0) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = prior_sigmas[i] * prior_sigmas[i];
  }
  return covariance;
}

}  // namespace mono3d::calibration
