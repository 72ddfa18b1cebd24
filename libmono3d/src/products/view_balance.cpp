// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/view_balance.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace mono3d {
namespace {

// Values near the ends are clipped, or dark enough for the noise to matter.
constexpr float kDarkestLevel = 8;
constexpr float kBrightestLevel = 247;

// Differences of the logarithm beyond this are of something else than the exposure: a tenth.
constexpr double kRobustScale = 0.1;

bool IsUsableLevel(float level) { return level >= kDarkestLevel && level <= kBrightestLevel; }

// One step of the robust fit, of one colour.
Eigen::VectorXd FitLogGains(const std::vector<ColourSample>& samples, int channel,
                            const Eigen::VectorXd& gains) {
  const Eigen::Index num_views = gains.size();
  // The gains as a whole are free: beforehand they are 0, with the weight of one sample.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(num_views, num_views);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(num_views);
  std::vector<Eigen::Index> views;
  std::vector<double> logs, weights;
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin;
    views.clear();
    logs.clear();
    weights.clear();
    double mean = 0;
    for (; end < samples.size() && samples[end].place == samples[begin].place; ++end) {
      const float level = samples[end].colour[channel];
      if (!IsUsableLevel(level)) continue;
      views.push_back(static_cast<Eigen::Index>(samples[end].view));
      logs.push_back(std::log(level));
      mean += logs.back() + gains[views.back()];
    }
    begin = end;
    if (views.size() < 2) continue;
    mean /= static_cast<double>(views.size());
    double sum = 0, log_mean = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double off = (logs[i] + gains[views[i]] - mean) / kRobustScale;
      weights.push_back(1 / (1 + off * off));
      sum += weights[i];
      log_mean += weights[i] * logs[i];
    }
    log_mean /= sum;
    for (std::size_t i = 0; i < views.size(); ++i) {
      right[views[i]] -= weights[i] * (logs[i] - log_mean);
      normal(views[i], views[i]) += weights[i];
      for (std::size_t j = 0; j < views.size(); ++j) {
        normal(views[i], views[j]) -= weights[i] * weights[j] / sum;
      }
    }
  }
  return normal.ldlt().solve(right);
}

}  // namespace

std::vector<cv::Vec3f> BalanceViews(const std::vector<ColourSample>& samples,
                                    std::size_t num_views) {
  constexpr int kRounds = 5;  // of reweighting
  std::vector<cv::Vec3f> factors(num_views, cv::Vec3f(1, 1, 1));
  if (num_views == 0) return factors;
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd gains = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(num_views));
    for (int round = 0; round < kRounds; ++round) gains = FitLogGains(samples, channel, gains);
    for (std::size_t view = 0; view < num_views; ++view) {
      factors[view][channel] = static_cast<float>(std::exp(gains[static_cast<Eigen::Index>(view)]));
    }
  }
  return factors;
}

}  // namespace mono3d
