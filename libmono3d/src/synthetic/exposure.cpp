// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/exposure.h"

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

constexpr double kMeanLevel = 0.18;  // the grey card that exposure meters are made for
constexpr double kSlowestDrift_s = 60;
constexpr double kFastestDrift_s = 10;
constexpr int kNumDriftSwings = 3;
// So that drift and steps have nothing in common.
constexpr std::uint64_t kStepSeedOffset = 0x5354'4550;

double AutoExposure(const cv::Mat& radiance, double share) {
  if (share <= 0) return 1;
  const cv::Scalar mean = cv::mean(radiance);
  const double level = (mean[0] + mean[1] + mean[2]) / 3;
  return level > 0 ? std::pow(kMeanLevel / level, share) : 1;
}

}  // namespace

double ExposureDrift(const SensorOptions& options, double t_s) {
  RandomNumbers random(static_cast<std::uint64_t>(options.seed));
  double stops = 0;
  for (int swing = 0; swing < kNumDriftSwings; ++swing) {
    const double period_s = random.Uniform(kFastestDrift_s, kSlowestDrift_s);
    const double phase = random.Uniform(0, 2 * std::numbers::pi);
    stops += std::sin(2 * std::numbers::pi * t_s / period_s + phase);
  }
  return std::exp2(options.exposure_drift_stops * std::sqrt(2.0 / kNumDriftSwings) * stops);
}

double ExposureStep(const SensorOptions& options, double t_s) {
  if (options.exposure_step <= 0) return 1;
  RandomNumbers random(kStepSeedOffset + static_cast<std::uint64_t>(options.seed));
  int level = 0;  // in steps; it stays within one of 0, so that the picture stays exposed
  double at_s = 0;
  while (true) {
    at_s += options.exposure_step_interval_s * random.Uniform(0.5, 1.5);
    const int direction = random.Chance(0.5) ? 1 : -1;
    if (at_s > t_s) return std::pow(1 + options.exposure_step, level);
    level += level == 0 ? direction : -level;
  }
}

double ExposureFactor(const cv::Mat& radiance, const SensorOptions& options, double t_s) {
  return options.exposure * AutoExposure(radiance, options.auto_exposure) *
         ExposureDrift(options, t_s) * ExposureStep(options, t_s);
}

}  // namespace mono3d::synthetic
