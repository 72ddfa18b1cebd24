// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/adaptive_baseline.h"

#include <algorithm>

namespace mono3d {
namespace {

constexpr double kPoorDensity = 0.5;  // more holes than surface
constexpr int kMaxNumPoor = 2;        // one may be a car that passes, or a turn
constexpr int kMaxCount = 4;          // the recursive mean is over about so many maps
// In maps: about two widths of the view in flight.
constexpr std::int64_t kExpiry = 16;

}  // namespace

void AdaptiveBaseline::ReportDepthQuality(std::size_t step, double density, double confidence) {
  ++num_reports_;
  std::optional<Quality>& quality = qualities_.at(step);
  if (!IsRecent(step)) quality = Quality();
  quality->count = std::min(quality->count + 1, kMaxCount);
  quality->confidence += (confidence - quality->confidence) / quality->count;
  quality->latest = num_reports_;
  if (step != current_) return;  // the bundle was chosen before the step was changed
  if (density >= kPoorDensity) {
    num_poor_ = 0;
    // Wider is more exact where it can be matched.
    if (current_ > 0 && !IsRecent(current_ - 1)) --current_;
    return;
  }
  if (++num_poor_ < kMaxNumPoor) return;
  num_poor_ = 0;
  current_ = BestStep();
}

bool AdaptiveBaseline::IsRecent(std::size_t step) const {
  return qualities_.at(step) && num_reports_ - qualities_.at(step)->latest < kExpiry;
}

// The widest without recent maps; else the one whose maps are the most confident.
std::size_t AdaptiveBaseline::BestStep() const {
  std::size_t best = 0;
  for (std::size_t step = 0; step < kShares.size(); ++step) {
    if (!IsRecent(step)) return step;
    if (qualities_.at(step)->confidence > qualities_.at(best)->confidence) best = step;
  }
  return best;
}

}  // namespace mono3d
