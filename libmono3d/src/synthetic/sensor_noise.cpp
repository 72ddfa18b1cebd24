// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

// Above it the normal distribution is near enough: skewness below 0.13.
constexpr float kMostCounted = 64;
// Seeds of a photon count and of its reading differ.
constexpr std::uint32_t kPhotonSeed = 0x5048'4F54U;

// Standard normal numbers from hashed bits (Box and Muller 1958).
float NormalNoise(cv::Point pixel, int channel, std::uint32_t seed) {
  const float u = std::max(HashUnit(pixel.x, pixel.y, 2 * channel, seed), 1e-7F);
  const float v = HashUnit(pixel.x, pixel.y, 2 * channel + 1, seed);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi_v<float> * v);
}

// The number whose cumulative probability is the first above `u`, 0 to 1.
int PoissonNumber(double mean, double u) {
  const int most = static_cast<int>(mean + 12 * std::sqrt(mean) + 12);  // u is below 1 by 1e-10
  double probability = std::exp(-mean);
  double cumulative = probability;
  int count = 0;
  while (u >= cumulative && count < most) {
    ++count;
    probability *= mean / count;
    cumulative += probability;
  }
  return count;
}

float SmoothValue(const cv::Mat& levels, cv::Point pixel, int channel, float max_difference) {
  constexpr int kRadius_px = 2;
  const float own = levels.at<cv::Vec3f>(pixel)[channel];
  float sum = 0;
  int num = 0;
  const int top = std::max(pixel.y - kRadius_px, 0);
  const int left = std::max(pixel.x - kRadius_px, 0);
  for (int y = top; y <= std::min(pixel.y + kRadius_px, levels.rows - 1); ++y) {
    for (int x = left; x <= std::min(pixel.x + kRadius_px, levels.cols - 1); ++x) {
      const float level = levels.at<cv::Vec3f>(y, x)[channel];
      if (std::abs(level - own) > max_difference) continue;
      sum += level;
      ++num;
    }
  }
  return sum / static_cast<float>(num);
}

}  // namespace

SensorNoise::SensorNoise(const SensorOptions& options, int frame)
    : seed_(HashBits(frame, options.seed, 0, 0)),
      shot_variance_(static_cast<float>(options.shot_noise * options.shot_noise)),
      read_variance_(static_cast<float>(options.read_noise * options.read_noise)) {
  if (options.full_well_electrons <= 0) return;
  const double at_white = options.full_well_electrons / options.gain;
  electrons_at_white_ = static_cast<float>(at_white);
  max_level_ = static_cast<float>(options.gain);
  shot_variance_ = static_cast<float>(1 / at_white);
  const double read_sigma = options.read_noise_electrons / at_white;
  read_variance_ = static_cast<float>(read_sigma * read_sigma);
}

float SensorNoise::Sigma(float level) const {
  return std::sqrt(shot_variance_ * std::max(level, 0.0F) + read_variance_);
}

float SensorNoise::Add(float level, cv::Point pixel, int channel) const {
  if (electrons_at_white_ <= 0) {
    return level +
           std::sqrt(shot_variance_ * level + read_variance_) * NormalNoise(pixel, channel, seed_);
  }
  const float reading = std::sqrt(read_variance_) * NormalNoise(pixel, channel, seed_);
  return Count(level, pixel, channel) / electrons_at_white_ + reading;
}

// Photons, all of which release an electron.
float SensorNoise::Count(float level, cv::Point pixel, int channel) const {
  const float mean = level * electrons_at_white_;
  const std::uint32_t seed = seed_ ^ kPhotonSeed;
  if (mean > kMostCounted) {
    return std::round(mean + std::sqrt(mean) * NormalNoise(pixel, channel, seed));
  }
  return static_cast<float>(PoissonNumber(mean, HashUnit(pixel.x, pixel.y, channel, seed)));
}

cv::Mat SmoothNoise(const cv::Mat& levels, const SensorNoise& noise, double share) {
  const auto weight = static_cast<float>(share);
  cv::Mat smooth(levels.size(), levels.type());
  cv::parallel_for_(cv::Range(0, levels.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        for (int channel = 0; channel < 3; ++channel) {
          const float level = levels.at<cv::Vec3f>(y, x)[channel];
          const float mean = SmoothValue(levels, {x, y}, channel, 2 * noise.Sigma(level));
          smooth.at<cv::Vec3f>(y, x)[channel] = level + weight * (mean - level);
        }
      }
    }
  });
  return smooth;
}

}  // namespace mono3d::synthetic
