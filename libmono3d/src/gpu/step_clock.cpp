// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/step_clock.h"

#include <algorithm>
#include <utility>

namespace mono3d {
namespace {

constexpr std::uint32_t kQueriesPerPool = 128;

}  // namespace

void StepClock::BeginStep(const vk::raii::CommandBuffer& commands, const std::string& name) {
  if (!names_.empty() && names_.back() == name) return;
  Write(commands);
  names_.push_back(name);
}

void StepClock::EndLastStep(const vk::raii::CommandBuffer& commands) {
  Write(commands);
  names_.emplace_back();
}

void StepClock::AddHostStep(const std::string& name, double wall_ms) {
  host_ms_.emplace_back(name, wall_ms);
}

void StepClock::Reset() {
  num_written_ = 0;
  names_.clear();
  host_ms_.clear();
}

void StepClock::Write(const vk::raii::CommandBuffer& commands) {
  if (device_->timestamp_mask() == 0) return;
  const std::uint32_t pool = num_written_ / kQueriesPerPool;
  const std::uint32_t query = num_written_ % kQueriesPerPool;
  if (pool == pools_.size()) {
    pools_.push_back(
        device_->vulkan().createQueryPool({{}, vk::QueryType::eTimestamp, kQueriesPerPool}));
  }
  if (query == 0) commands.resetQueryPool(*pools_[pool], 0, kQueriesPerPool);
  commands.writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *pools_[pool], query);
  ++num_written_;
}

std::vector<std::uint64_t> StepClock::ReadTimestamps() const {
  std::vector<std::uint64_t> timestamps;
  for (std::uint32_t first = 0; first < num_written_; first += kQueriesPerPool) {
    const std::uint32_t count = std::min(kQueriesPerPool, num_written_ - first);
    const auto [result, part] = pools_[first / kQueriesPerPool].getResults<std::uint64_t>(
        0, count, count * sizeof(std::uint64_t), sizeof(std::uint64_t),
        vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    if (result != vk::Result::eSuccess) {
      throw MakeVulkanError(device_->info().name, "reading timestamps", result);
    }
    timestamps.insert(timestamps.end(), part.begin(), part.end());
  }
  return timestamps;
}

void StepClock::AddTo(StageTimes& times) const {
  const std::vector<std::uint64_t> timestamps = ReadTimestamps();
  std::vector<std::pair<std::string, double>> sums_ms;
  const auto add = [&](const std::string& name, double step_ms) {
    const auto found = std::find_if(sums_ms.begin(), sums_ms.end(),
                                    [&](const auto& sum) { return sum.first == name; });
    if (found == sums_ms.end()) {
      sums_ms.emplace_back(name, step_ms);
    } else {
      found->second += step_ms;
    }
  };
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i].empty()) continue;
    double step_ms = 0;
    if (!timestamps.empty()) {
      // Masked: a counter of few bits may wrap around between the two.
      const std::uint64_t ticks = (timestamps[i + 1] - timestamps[i]) & device_->timestamp_mask();
      step_ms = static_cast<double>(ticks) * device_->timestamp_period_ns() * 1e-6;
    }
    add(names_[i], step_ms);
  }
  for (const auto& [name, wall_ms] : host_ms_) add(name, wall_ms);
  for (const auto& [name, gpu_ms] : sums_ms) times.Add(name, 0, gpu_ms);
}

}  // namespace mono3d
