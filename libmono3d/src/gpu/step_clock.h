// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gpu/device_internals.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// GPU times of the steps of one command buffer: a timestamp before the first and after each. The
// steps are kept apart by barriers, so the difference is the time of the step.
class StepClock {
 public:
  explicit StepClock(std::shared_ptr<Device> device) : device_(std::move(device)) {}

  void Start(const vk::raii::CommandBuffer& commands);
  void EndStep(const vk::raii::CommandBuffer& commands, const std::string& name);

  // After the command buffer has run: adds one call per name, in the order of first appearance.
  void AddTo(StageTimes& times) const;

 private:
  void Write(const vk::raii::CommandBuffer& commands, vk::PipelineStageFlagBits stage);
  std::vector<std::uint64_t> ReadTimestamps() const;

  std::shared_ptr<Device> device_;
  std::vector<vk::raii::QueryPool> pools_;  // kept from one submission to the next
  std::uint32_t num_written_ = 0;
  std::vector<std::string> names_;  // of the steps
};

}  // namespace mono3d
