// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/health.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "fusion/state_archive.h"

namespace mono3d {
namespace {

std::string Percent(const char* what, double share) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "%s: %.0f %%", what, 100 * share);
  return text.data();
}

// What depth maps differ from the model by over what their noise explains.
std::string TimesTheNoise(double sigmas) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(),
                "depth maps at a distance from the model of %.1f times their noise", sigmas);
  return text.data();
}

}  // namespace

const char* ToString(HealthState state) {
  switch (state) {
    case HealthState::kGood:
      return "good";
    case HealthState::kDegraded:
      return "degraded";
    case HealthState::kBroken:
      return "broken";
  }
  return "unknown";
}

void HealthMonitor::Add(const RegistrationEvidence& evidence, bool is_accepted) {
  records_.push_back({evidence, is_accepted});
  if (static_cast<int>(records_.size()) > options_.num_registrations) records_.pop_front();
}

void HealthMonitor::AcceptLate() {
  const auto refused = std::find_if(records_.begin(), records_.end(),
                                    [](const Record& record) { return !record.is_accepted; });
  if (refused != records_.end()) records_.erase(refused);
}

ModelHealth HealthMonitor::Assess() const {
  ModelHealth health;
  health.num_registrations = static_cast<int>(records_.size());
  double num_accepted = 0;
  double num_moved = 0;
  double squares = 0;
  for (const Record& record : records_) {
    if (!record.is_accepted) continue;
    num_accepted += 1;
    num_moved += record.evidence.moved ? 1 : 0;
    squares += record.evidence.depth_residual * record.evidence.depth_residual;
    health.scale_drift = record.evidence.scale_deviation;
    health.deviation_px = record.evidence.deviation_px;
  }
  if (records_.empty()) return health;
  health.accepted_share = num_accepted / static_cast<double>(records_.size());
  if (num_accepted > 0) {
    health.moved_share = num_moved / num_accepted;
    health.depth_residual = std::sqrt(squares / num_accepted);
  }
  if (health.num_registrations < options_.min_registrations) return health;
  health.state = HealthState::kDegraded;
  if (health.accepted_share < options_.min_accepted_share) {
    health.state = HealthState::kBroken;
    health.reason = Percent("depth maps that fit the model", health.accepted_share);
  } else if (health.moved_share > options_.max_moved_share &&
             health.depth_residual > options_.max_depth_residual) {
    // Either alone may be innocent: a tracker that drifts is followed, depth maps may claim too
    // little. Where both are, no pose explains what the depth maps show: the camera is not as told,
    // or the poses behind them are wrong.
    health.state = HealthState::kBroken;
    health.reason = Percent("depth maps not where the tracker has them", health.moved_share) +
                    ", " + TimesTheNoise(health.depth_residual);
  } else if (health.accepted_share < options_.good_accepted_share) {
    health.reason = Percent("depth maps that fit the model", health.accepted_share);
  } else if (health.moved_share > options_.max_moved_share) {
    health.reason = Percent("depth maps not where the tracker has them", health.moved_share);
  } else if (health.depth_residual > options_.max_depth_residual) {
    health.reason = TimesTheNoise(health.depth_residual);
  } else if (std::abs(health.scale_drift) > options_.max_scale_drift) {
    health.reason = Percent("scale of the tracker off by", health.scale_drift);
  } else {
    health.state = HealthState::kGood;
  }
  return health;
}

template <typename Archive>
void HealthMonitor::Exchange(Archive& archive) {
  ExchangeDeque(archive, records_, [&](Record& record) {
    RegistrationEvidence& evidence = record.evidence;
    archive.Number(evidence.registered);
    archive.Number(evidence.moved);
    archive.Number(evidence.num_iterations);
    for (double* number :
         {&evidence.tracker_misfit, &evidence.overlap, &evidence.noise, &evidence.agreement,
          &evidence.contradiction, &evidence.depth_residual, &evidence.grey_residual,
          &evidence.grey_correlation, &evidence.deviation_px, &evidence.scale_deviation,
          &evidence.uncertainty_px}) {
      archive.Bytes(number, sizeof(*number));  // may be none: nothing was seen
    }
    archive.Number(record.is_accepted);
  });
}

template void HealthMonitor::Exchange(ByteWriter& archive);
template void HealthMonitor::Exchange(ByteReader& archive);

}  // namespace mono3d
