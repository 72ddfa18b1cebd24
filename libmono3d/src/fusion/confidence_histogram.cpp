// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/confidence_histogram.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace mono3d {

void ConfidenceHistogram::Add(double confidence) {
  constexpr double kLast = kNumBins - 1;
  const double bin = confidence > 0 ? -kBinsPerOctave * std::log2(confidence) : kLast;
  ++num_of_bin_[static_cast<std::size_t>(std::clamp(bin, 0.0, kLast))];
}

void ConfidenceHistogram::Add(const PointCloud& surfels) {
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!IsInferred(surfels, i)) Add(surfels.confidences[i]);
  }
}

void ConfidenceHistogram::Add(const ConfidenceHistogram& other) {
  for (std::size_t i = 0; i < kNumBins; ++i) num_of_bin_[i] += other.num_of_bin_[i];
}

double ConfidenceHistogram::LimitFor(const SurfelExportOptions& options) const {
  const auto num = std::accumulate(num_of_bin_.begin(), num_of_bin_.end(), std::uint64_t{0});
  double num_left = options.min_share * static_cast<double>(num);
  std::size_t bin = 0;
  while (bin < kNumBins && num_left > 0) num_left -= num_of_bin_[bin++];
  if (bin == kNumBins) return std::min(options.min_confidence, std::numeric_limits<double>::min());
  const double of_least = std::exp2(-static_cast<double>(bin) / kBinsPerOctave);
  return std::min(options.min_confidence, of_least);
}

}  // namespace mono3d
