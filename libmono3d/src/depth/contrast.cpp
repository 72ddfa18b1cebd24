// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/contrast.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace mono3d {
namespace {

// Without the ends: what is clipped in one of the images, and what only one of them shows.
constexpr double kFirstQuantile = 0.1;
constexpr double kLastQuantile = 0.9;
constexpr int kNumQuantiles = 33;
// Every third row is enough: tens of thousands of pixels of any image.
constexpr int kRowStep = 3;
// Variance of the quantiles, grey values squared, below which rounding decides on the slope.
constexpr double kMinVariance = 4;
constexpr double kMaxContrastGain = 4;

using GreyQuantiles = std::array<double, kNumQuantiles>;

// Between whole grey values as if those of one value were spread evenly over it.
GreyQuantiles QuantilesOf(const cv::Mat& grey) {
  std::array<int, 256> pixels{};
  double total = 0;
  for (int y = 0; y < grey.rows; y += kRowStep) {
    const auto* row = grey.ptr<std::uint8_t>(y);
    for (int x = 0; x < grey.cols; ++x) ++pixels[row[x]];
    total += grey.cols;
  }
  std::array<double, 256> counts{};
  std::copy(pixels.begin(), pixels.end(), counts.begin());
  GreyQuantiles quantiles{};
  std::size_t value = 0;
  double below = 0;
  for (int i = 0; i < kNumQuantiles; ++i) {
    const double share =
        kFirstQuantile + (kLastQuantile - kFirstQuantile) * i / (kNumQuantiles - 1);
    while (value + 1 < counts.size() && below + counts[value] < share * total) {
      below += counts[value++];
    }
    const double within = counts[value] > 0 ? (share * total - below) / counts[value] : 0;
    quantiles[static_cast<std::size_t>(i)] = static_cast<double>(value) - 0.5 + within;
  }
  return quantiles;
}

double VarianceOf(const GreyQuantiles& quantiles) {
  double sum = 0;
  double squares = 0;
  for (const double quantile : quantiles) {
    sum += quantile;
    squares += quantile * quantile;
  }
  return (squares - sum * sum / kNumQuantiles) / kNumQuantiles;
}

}  // namespace

double ContrastOf(const cv::Mat& grey) { return VarianceOf(QuantilesOf(grey)); }

double ContrastGain(double of_reference, double of_image) {
  if (of_reference < kMinVariance || of_image < kMinVariance) return 1;
  return std::clamp(std::sqrt(of_reference / of_image), 1 / kMaxContrastGain, kMaxContrastGain);
}

}  // namespace mono3d
