// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "mono3d/core/error.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

constexpr double kMeanLevel = 0.18;  // the grey card that exposure meters are made for
constexpr double kSlowestDrift_s = 60;
constexpr double kFastestDrift_s = 10;
constexpr int kNumDriftSwings = 3;
constexpr float kGamma = 2.2F;

// Standard normal numbers from hashed bits (Box and Muller 1958).
float NormalNoise(cv::Point pixel, int channel, std::uint32_t seed) {
  const float u = std::max(HashUnit(pixel.x, pixel.y, 2 * channel, seed), 1e-7F);
  const float v = HashUnit(pixel.x, pixel.y, 2 * channel + 1, seed);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi_v<float> * v);
}

double AutoExposure(const cv::Mat& radiance, double share) {
  if (share <= 0) return 1;
  const cv::Scalar mean = cv::mean(radiance);
  const double level = (mean[0] + mean[1] + mean[2]) / 3;
  return level > 0 ? std::pow(kMeanLevel / level, share) : 1;
}

void RequireNonNegative(const char* name, double value) {
  RequireOption(std::isfinite(value) && value >= 0, name, "at least 0", value);
}

}  // namespace

void SensorOptions::Visit(OptionVisitor& visit) {
  visit("readout_s", readout_s, "rolling shutter: from the first row to the last, seconds");
  visit("exposure_s", exposure_s, "motion blur: how long the shutter is open, seconds");
  visit("exposure", exposure, "brightness factor");
  visit("auto_exposure", auto_exposure, "share of the way to a mean level of 0.18, 0 to 1");
  visit("exposure_drift_stops", exposure_drift_stops, "standard deviation of a slow drift, stops");
  visit("vignetting", vignetting, "share of the light lost in the corners, below 1");
  visit("shot_noise", shot_noise, "standard deviation at full level, full level = 1");
  visit("read_noise", read_noise, "standard deviation at every level, full level = 1");
  visit("seed", seed, "seed of drift and noise");
}

void SensorOptions::Validate() const {
  RequireNonNegative("sensor.readout_s", readout_s);
  RequireNonNegative("sensor.exposure_s", exposure_s);
  RequireOption(std::isfinite(exposure) && exposure > 0, "sensor.exposure", "above 0", exposure);
  RequireOption(auto_exposure >= 0 && auto_exposure <= 1, "sensor.auto_exposure", "0 to 1",
                auto_exposure);
  RequireNonNegative("sensor.exposure_drift_stops", exposure_drift_stops);
  RequireOption(vignetting >= 0 && vignetting < 1, "sensor.vignetting", "at least 0, below 1",
                vignetting);
  RequireNonNegative("sensor.shot_noise", shot_noise);
  RequireNonNegative("sensor.read_noise", read_noise);
}

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

cv::Mat Develop(const cv::Mat& radiance, const SensorOptions& options, double t_s, int frame) {
  options.Validate();
  if (radiance.type() != CV_32FC3) throw Error("radiance to be developed must be CV_32FC3");
  const auto gain =
      static_cast<float>(options.exposure * AutoExposure(radiance, options.auto_exposure) *
                         ExposureDrift(options, t_s));
  const auto vignetting = static_cast<float>(options.vignetting);
  const auto shot_variance = static_cast<float>(options.shot_noise * options.shot_noise);
  const auto read_variance = static_cast<float>(options.read_noise * options.read_noise);
  const bool is_noisy = shot_variance + read_variance > 0;
  const std::uint32_t seed = HashBits(frame, options.seed, 0, 0);
  const cv::Point2f middle(0.5F * static_cast<float>(radiance.cols - 1),
                           0.5F * static_cast<float>(radiance.rows - 1));
  const float corner_square = std::max(middle.dot(middle), 1.0F);
  cv::Mat bgr(radiance.size(), CV_8UC3);
  cv::parallel_for_(cv::Range(0, radiance.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < radiance.cols; ++x) {
        const cv::Point2f off(static_cast<float>(x) - middle.x, static_cast<float>(y) - middle.y);
        const float light = gain * (1 - vignetting * off.dot(off) / corner_square);
        for (int channel = 0; channel < 3; ++channel) {
          float level = std::clamp(light * radiance.at<cv::Vec3f>(y, x)[channel], 0.0F, 1.0F);
          if (is_noisy) {
            level += std::sqrt(shot_variance * level + read_variance) *
                     NormalNoise({x, y}, channel, seed);
          }
          const float grey = 255 * std::pow(std::clamp(level, 0.0F, 1.0F), 1 / kGamma);
          bgr.at<cv::Vec3b>(y, x)[channel] = static_cast<std::uint8_t>(grey + 0.5F);
        }
      }
    }
  });
  return bgr;
}

}  // namespace mono3d::synthetic
