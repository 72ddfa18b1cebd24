// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/device_times.h"

#include <algorithm>

namespace mono3d::tools {

Spread SpreadOf(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values.front(), values[values.size() / 2]};
}

Json ToJson(const Spread& ms) { return {{"least_ms", ms.least}, {"median_ms", ms.median}}; }

void StageDifferences::Add(const std::vector<StageTime>& times) {
  for (const StageTime& time : times) {
    double& last = last_[time.stage];
    if (time.gpu_ms == last) continue;
    if (!values_.contains(time.stage)) names_.push_back(time.stage);
    values_[time.stage].push_back(time.gpu_ms - last);
    last = time.gpu_ms;
  }
}

void StageDifferences::Skip(const std::vector<StageTime>& times) {
  for (const StageTime& time : times) last_[time.stage] = time.gpu_ms;
}

std::vector<StageSpread> StageDifferences::Stages() const {
  std::vector<StageSpread> stages;
  for (const std::string& name : names_) stages.push_back({name, SpreadOf(values_.at(name))});
  return stages;
}

}  // namespace mono3d::tools
