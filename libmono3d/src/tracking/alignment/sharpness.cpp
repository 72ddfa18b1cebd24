// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/sharpness.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace mono3d::tracking {
namespace {

// A difference that is none of content: some .5 px of motion blur, four times what images without
// blur differ by.
constexpr double kClearDifference = 0.05;
constexpr std::size_t kFewestImages = 5;  // to compare with

// By central differences; every second row is enough for a mean.
double MeanSquaredGradient(const cv::Mat& grey) {
  std::int64_t sum = 0;
  std::int64_t count = 0;
  for (int y = 1; y + 1 < grey.rows; y += 2) {
    const std::uint8_t* above = grey.ptr<std::uint8_t>(y - 1);
    const std::uint8_t* row = grey.ptr<std::uint8_t>(y);
    const std::uint8_t* below = grey.ptr<std::uint8_t>(y + 1);
    std::int32_t row_sum = 0;  // of 65025 * 2 at most for each pixel
    for (int x = 1; x + 1 < grey.cols; ++x) {
      const int dx = row[x + 1] - row[x - 1];
      const int dy = below[x] - above[x];
      row_sum += dx * dx + dy * dy;
    }
    sum += row_sum;
    count += std::max(0, grey.cols - 2);
  }
  return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0;
}

}  // namespace

double LogSharpness(const Octaves& octaves) {
  constexpr std::size_t kCoarse = 2;
  if (octaves.size() <= kCoarse) return 0;
  const double fine = MeanSquaredGradient(octaves[0]);
  const double coarse = MeanSquaredGradient(octaves[kCoarse]);
  return fine > 0 && coarse > 0 ? 0.5 * std::log(fine / coarse) : 0;
}

double SharpnessHistory::Quantile(double share) const {
  std::vector<double> sorted = log_sharpness_;
  const auto nth =
      sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), nth, sorted.end());
  return *nth;
}

bool SharpnessHistory::IsBlurred(double log_sharpness) const {
  return log_sharpness_.size() >= kFewestImages && log_sharpness < Quantile(0.5) - kClearDifference;
}

bool SharpnessHistory::IsSharp(double log_sharpness) const {
  return log_sharpness_.size() >= kFewestImages &&
         log_sharpness > Quantile(0.5) + kClearDifference && log_sharpness >= Quantile(0.9);
}

}  // namespace mono3d::tracking
