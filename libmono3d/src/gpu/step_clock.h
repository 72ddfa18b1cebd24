// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device_internals.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// Times of the steps of one submission, of its command buffers and of the host kernels between
// them. In a command buffer a timestamp where the name changes and one at the end. The steps are
// kept apart by barriers, so the difference is the time of the steps between. Not one per step,
// because lavapipe takes twice as long for a timestamp as for a small dispatch.
class StepClock {
 public:
  explicit StepClock(std::shared_ptr<Device> device) : device_(std::move(device)) {}

  void BeginStep(const vk::raii::CommandBuffer& commands, const std::string& name);
  void EndLastStep(const vk::raii::CommandBuffer& commands);  // of this command buffer
  void AddHostStep(const std::string& name, double wall_ms);
  void Reset();  // before the next submission

  // After all has run: adds one call per name, those of host kernels last.
  void AddTo(StageTimes& times) const;

 private:
  void Write(const vk::raii::CommandBuffer& commands);
  std::vector<std::uint64_t> ReadTimestamps() const;

  std::shared_ptr<Device> device_;
  std::vector<vk::raii::QueryPool> pools_;  // kept from one submission to the next
  std::uint32_t num_written_ = 0;
  std::vector<std::string> names_;  // after timestamp i runs names_[i]; empty: nothing
  std::vector<std::pair<std::string, double>> host_ms_;
};

}  // namespace mono3d
