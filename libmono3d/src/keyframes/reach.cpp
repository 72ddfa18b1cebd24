// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "keyframes/reach.h"

#include <algorithm>

namespace mono3d {
namespace {

constexpr double kPoorDensity = 0.5;  // more holes than surface
constexpr int kPatience = 2;          // one may be a car that passes, or a turn
constexpr int kMaxCount = 4;          // the recursive mean is over about so many maps
constexpr std::int64_t kMemory = 16;  // maps: some two views' width of flight

}  // namespace

void Reach::ReportDepthQuality(std::size_t width, double density, double worth) {
  ++num_heard_;
  std::optional<Heard>& heard = heard_.at(width);
  if (!IsFresh(width)) heard.emplace();
  heard->count = std::min(heard->count + 1, kMaxCount);
  heard->worth += (worth - heard->worth) / heard->count;
  heard->latest = num_heard_;
  if (width != current_) return;  // on its way when the width was changed
  if (density >= kPoorDensity) {
    num_poor_ = 0;
    // Wider is more exact where it can be matched.
    if (current_ > 0 && !IsFresh(current_ - 1)) --current_;
    return;
  }
  if (++num_poor_ < kPatience) return;
  num_poor_ = 0;
  current_ = Best();
}

bool Reach::IsFresh(std::size_t width) const {
  return heard_.at(width) && num_heard_ - heard_.at(width)->latest < kMemory;
}

// One that nothing is known of, wide ones first; else that whose maps were worth most.
std::size_t Reach::Best() const {
  std::size_t best = 0;
  for (std::size_t width = 0; width < kShares.size(); ++width) {
    if (!IsFresh(width)) return width;
    if (heard_.at(width)->worth > heard_.at(best)->worth) best = width;
  }
  return best;
}

}  // namespace mono3d
