// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>
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

constexpr int kSmoothRadius_px = 2;
constexpr int kSmoothSide_px = 2 * kSmoothRadius_px + 1;

// The mean of those values about `own` that differ from it by at most `limit`. Without branches:
// most of the time of the filter is here.
float MeanOfAlike(const std::array<const float*, kSmoothSide_px>& rows, std::ptrdiff_t i, float own,
                  float limit) {
  constexpr int kChannels = 3;
  float sum = 0;
  float count = 0;
  for (const float* row : rows) {
    for (int dx = 0; dx < kSmoothSide_px; ++dx) {
      const float other = row[i + kChannels * dx];
      const float is_alike = std::abs(other - own) <= limit ? 1.0F : 0.0F;
      sum += is_alike * other;
      count += is_alike;
    }
  }
  return sum / count;  // `own` is one of them
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
  constexpr int kRadius = kSmoothRadius_px;
  constexpr int kChannels = 3;
  const auto weight = static_cast<float>(share);
  cv::Mat padded;
  cv::copyMakeBorder(levels, padded, kRadius, kRadius, kRadius, kRadius, cv::BORDER_REFLECT_101);
  cv::Mat smooth(levels.size(), levels.type());
  cv::parallel_for_(cv::Range(0, levels.rows), [&](const cv::Range& range) {
    for (int y = range.start; y < range.end; ++y) {
      std::array<const float*, kSmoothSide_px> rows{};
      for (int dy = 0; dy < kSmoothSide_px; ++dy) {
        rows[static_cast<std::size_t>(dy)] = padded.ptr<float>(y + dy);
      }
      const auto* own = levels.ptr<float>(y);
      auto* out = smooth.ptr<float>(y);
      for (std::ptrdiff_t i = 0; i < kChannels * levels.cols; ++i) {
        const float mean = MeanOfAlike(rows, i, own[i], 2 * noise.Sigma(own[i]));
        out[i] = own[i] + weight * (mean - own[i]);
      }
    }
  });
  return smooth;
}

}  // namespace mono3d::synthetic
