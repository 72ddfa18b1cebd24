// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace mono3d {

WhitenedRows Whiten(const Eigen::MatrixXd& rows, std::span<const double> times_s,
                    const std::vector<bool>& is_used, const PositionNoise& noise) {
  const double wander = noise.wander_m * noise.wander_m;
  const double white = noise.white_m * noise.white_m;
  WhitenedRows whitened{Eigen::MatrixXd(rows.rows(), rows.cols()), 0};
  Eigen::RowVectorXd state = Eigen::RowVectorXd::Zero(rows.cols());  // of each column
  double variance = wander;                                          // of the state's error
  double last_s = times_s.empty() ? 0 : times_s.front();
  Eigen::Index num_rows = 0;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!is_used[k]) continue;
    const double step_s = times_s[k] - last_s;
    last_s = times_s[k];
    const double kept = noise.correlation_s > 0 ? std::exp(-step_s / noise.correlation_s) : 0;
    state *= kept;
    variance = kept * kept * variance + (1 - kept * kept) * wander;
    const double innovation_variance = variance + white;
    const double gain = variance / innovation_variance;
    const Eigen::RowVectorXd innovation = rows.row(i) - state;
    state += gain * innovation;
    variance *= 1 - gain;
    whitened.rows.row(num_rows++) = innovation / std::sqrt(innovation_variance);
    whitened.sum_log_sigma += std::log(innovation_variance) / 2;
  }
  whitened.rows.conservativeResize(num_rows, Eigen::NoChange);
  return whitened;
}

std::vector<NoiseShape> NoiseShapes() {
  // Satellite navigation without corrections wanders over half a minute to five minutes; barometers
  // and RTK alike, by less. Written faster than it is measured, it is filtered as well.
  constexpr std::array<double, 6> kTimes_s = {1, 5, 15, 40, 100, 300};
  constexpr std::array<double, 4> kWanderShares = {0.3, 0.7, 0.95, 0.998};  // of the variance
  constexpr double kTypicalTime_s = 95;  // between half a minute and five
  constexpr double kLogTimeSigma = 1.6;  // a factor of five
  // A rate of measurements below the correlation tells the two parts apart; above it they are one.
  constexpr double kWhitePrior = 0.2;
  std::vector<NoiseShape> shapes = {{{0, 0, 1}, std::log(kWhitePrior)}};
  double sum = 0;
  for (const double time_s : kTimes_s) {
    const double deviation = std::log(time_s / kTypicalTime_s) / kLogTimeSigma;
    for (const double share : kWanderShares) {
      const double weight = std::exp(-deviation * deviation / 2);
      sum += weight;
      shapes.push_back({{std::sqrt(share), time_s, std::sqrt(1 - share)}, std::log(weight)});
    }
  }
  for (std::size_t i = 1; i < shapes.size(); ++i) {
    shapes[i].log_prior += std::log((1 - kWhitePrior) / sum);
  }
  return shapes;
}

}  // namespace mono3d
