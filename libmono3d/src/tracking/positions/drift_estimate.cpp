// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/drift_estimate.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "tracking/positions/drift_filter.h"

namespace mono3d::tracking {
namespace {

// Logarithms of the drift of rotation and scale; of the errors' standard deviation, correlation
// time and ratio of the wandering part's variance to the white one's, horizontal and vertical.
using Parameters = Eigen::Matrix<double, 8, 1>;

// Of the drift the logarithm is Laplace distributed, with this mean distance: it stays at what
// the images say unless the positions contradict that, and a drift that is far larger, as with a
// wrong calibration, they tell beyond doubt. Over a few minutes what positions wander by looks like
// drift; a normal distribution would let it pass for some, and bend the path.
constexpr double kDriftScale = 1.0 / 3;
constexpr Eigen::Index kNumDrifts = 2;

struct Priors {
  Parameters mean;
  Parameters sigma;
};

// Receivers without corrections wander over half a minute to some minutes, and how much of their
// error is white is anybody's guess. What changes from one position to the next looks alike for an
// error of 1.5 m over 20 s and one of 3 m over 80 s: of both, the images should be believed as for
// the latter.
Priors PriorsOf(const PositionedPath& path) {
  const double log_time = std::log(100.0);
  constexpr double kLogTimeSigma = 1;
  constexpr double kLogRatioSigma = 3;  // white parts of 5 to 95 % are likely alike
  const double sigma_sigma = 1 / std::sqrt(2 * path.worth);  // of the logarithm of a sigma
  Priors priors;
  priors.mean << std::log(path.drift.rotation_rad), std::log(path.drift.log_scale),
      std::log(path.typical_horizontal_m), log_time, 0, std::log(path.typical_vertical_m), log_time,
      0;
  priors.sigma << kDriftScale, kDriftScale, sigma_sigma, kLogTimeSigma, kLogRatioSigma, sigma_sigma,
      kLogTimeSigma, kLogRatioSigma;
  return priors;
}

PositionNoise NoiseOf(const Eigen::Vector3d& parameters) {
  const double sigma_m = std::exp(parameters[0]);
  const double share = 1 / (1 + std::exp(-parameters[2]));
  return {sigma_m * std::sqrt(share), std::exp(parameters[1]), sigma_m * std::sqrt(1 - share)};
}

PathNoise PathNoiseOf(const Parameters& parameters) {
  return {{std::exp(parameters[0]), std::exp(parameters[1])},
          NoiseOf(parameters.segment<3>(2)),
          NoiseOf(parameters.segment<3>(5))};
}

// Pattern search (Hooke and Jeeves 1961) along the axes: the likelihood is cheap, smooth but for
// the outliers, and has no derivatives at hand.
class DriftSearch {
 public:
  DriftSearch(const PositionedPath& path, const DriftFilter& filter)
      : filter_(filter), priors_(PriorsOf(path)), num_(path.has_vertical ? 8 : 5) {}

  std::pair<Parameters, double> From(Parameters at) const {
    // Of the prior's sigma: half of it at first, down to what changes the result by next to
    // nothing.
    constexpr double kFirstStep = 0.5;
    constexpr double kLastStep = 0.04;
    double value = Value(at);
    Parameters before = at;
    for (double step = kFirstStep; step > kLastStep;) {
      const Parameters last = at;
      if (!Explore(step, at, value)) {
        step /= 2;
        continue;
      }
      const Parameters further = Within(at + (at - before));  // on in the direction that was good
      double value_further = Value(further);
      if (value_further > value) {
        at = further;
        value = value_further;
      }
      before = last;
    }
    return {at, value};
  }

  const Priors& priors() const { return priors_; }

 private:
  // Of the prior's sigma; of the drift a factor of a thousand either way. Beyond, the filter loses
  // its digits.
  static constexpr double kMost = 3;
  static constexpr double kMostOfDrift = 21;

  double Value(const Parameters& parameters) const {
    // What is not measured stays where the prior has it.
    const Parameters deviation = (parameters - priors_.mean).cwiseQuotient(priors_.sigma);
    return filter_.Run(PathNoiseOf(parameters)).log_likelihood -
           deviation.head<kNumDrifts>().lpNorm<1>() -
           deviation.tail<8 - kNumDrifts>().squaredNorm() / 2;
  }

  double MostOf(Eigen::Index i) const {
    return (i < kNumDrifts ? kMostOfDrift : kMost) * priors_.sigma[i];
  }

  Parameters Within(Parameters parameters) const {
    for (Eigen::Index i = 0; i < parameters.size(); ++i) {
      parameters[i] =
          std::clamp(parameters[i], priors_.mean[i] - MostOf(i), priors_.mean[i] + MostOf(i));
    }
    return parameters;
  }

  bool Explore(double step, Parameters& at, double& value) const {
    bool is_better = false;
    for (Eigen::Index i = 0; i < num_; ++i) {
      for (const double sign : {1.0, -1.0}) {
        Parameters next = at;
        next[i] += sign * step * priors_.sigma[i];
        if (std::abs(next[i] - priors_.mean[i]) > MostOf(i)) continue;
        const double next_value = Value(next);
        if (!(next_value > value)) continue;  // nor where there is none
        at = next;
        value = next_value;
        is_better = true;
        break;
      }
    }
    return is_better;
  }

  const DriftFilter& filter_;
  Priors priors_;
  Eigen::Index num_;
};

std::pair<Parameters, double> FindNoise(const PositionedPath& path, const DriftFilter& filter) {
  const DriftSearch search(path, filter);
  // Errors that are mostly white, and such that wander: the likelihood may have a maximum at each.
  // And where drift is far larger than that of a tracker, nearly all positions are outliers to a
  // small one, which a few steps do not change.
  constexpr double kLargeDrift = 30;  // times that of the prior
  std::pair<Parameters, double> best;
  bool is_first = true;
  for (const double drift : {1.0, kLargeDrift}) {
    for (const double log_ratio : {-3.0, 3.0}) {
      Parameters start = search.priors().mean;
      start.head<kNumDrifts>().array() += std::log(drift);
      start[4] = log_ratio;
      start[7] = log_ratio;
      const std::pair<Parameters, double> found = search.From(start);
      if (is_first || found.second > best.second) best = found;
      is_first = false;
    }
  }
  return best;
}

// From its end to its beginning.
PositionedPath Reversed(const PositionedPath& path) {
  PositionedPath reversed = path;
  const std::size_t last = path.S_metric_kf.size() - 1;
  std::ranges::reverse(reversed.S_metric_kf);
  for (std::size_t k = 0; k < last; ++k) {
    reversed.edges[k] = {k, k + 1, path.edges[last - 1 - k].S_b_a.Inverse()};
  }
  std::ranges::reverse(reversed.positions);
  for (PathPosition& position : reversed.positions) {
    position.node = last - position.node;
    position.time_s = -position.time_s;
  }
  return reversed;
}

}  // namespace

DriftEstimate EstimateDrift(const PositionedPath& path) {
  DriftFilter filter(path);
  DriftEstimate estimate{PathNoiseOf(FindNoise(path, filter).first), {}};
  estimate.is_outlier = filter.Run(estimate.noise).is_outlier;
  // At the start, where nothing is known yet, everything is plausible. From the other end it is
  // the last to come.
  constexpr std::size_t kStart = 10;  // by then a similarity is known
  std::vector<char> from_end = DriftFilter(Reversed(path)).Run(estimate.noise).is_outlier;
  std::ranges::reverse(from_end);
  bool has_more = false;
  for (std::size_t i = 0; i < from_end.size(); ++i) {
    if (i >= kStart || estimate.is_outlier[i] != 0) from_end[i] = 0;
    has_more = has_more || from_end[i] != 0;
  }
  if (!has_more) return estimate;
  filter.LeaveOut(from_end);
  estimate.noise = PathNoiseOf(FindNoise(path, filter).first);
  estimate.is_outlier = filter.Run(estimate.noise).is_outlier;
  return estimate;
}

}  // namespace mono3d::tracking
