// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/bundle_matching.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace mono3d {
namespace {

// As many as HealthOptions looks back upon, and needs.
constexpr std::size_t kNumBundles = 8;
constexpr std::size_t kMinBundles = 4;

}  // namespace

void BundleMatching::Add(const DepthResult& depth) {
  const bool matched = depth.status == DepthStatus::kEstimated;
  if (!matched && depth.rejection != DepthRejection::kNoMatch) return;
  matched_.push_back(matched ? 1 : 0);
  if (matched_.size() > kNumBundles) matched_.erase(matched_.begin());
}

ModelHealth BundleMatching::Judge(ModelHealth health) const {
  const auto num_unmatched = static_cast<std::size_t>(std::ranges::count(matched_, 0));
  if (matched_.size() < kMinBundles || 2 * num_unmatched <= matched_.size()) return health;
  if (health.state != HealthState::kGood) return health;
  health.state = HealthState::kDegraded;
  const double share = static_cast<double>(num_unmatched) / static_cast<double>(matched_.size());
  health.reason =
      "bundles whose images do not match: " + std::to_string(std::lround(100 * share)) + " %";
  return health;
}

}  // namespace mono3d
