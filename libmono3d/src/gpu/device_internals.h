// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/large_memory.h"
#include "gpu/device_handle.h"
#include "gpu/features.h"
#include "gpu/host_memory.h"
#include "gpu/instance.h"
#include "gpu/pipeline_cache.h"
#include "gpu/vulkan_calls.h"

namespace mono3d {

class HostThreads;
class Staging;

// The open device as the files of this module see it. Its public face is mono3d/gpu/device.h and
// gpu/device_handle.h. Thread-safe.
class Device {
 public:
  Device(Instance instance, Candidate candidate, const DeviceOptions& options,
         HostMemory host_memory);
  ~Device();

  const DeviceInfo& info() const { return candidate_.info; }
  const DeviceLimits& limits() const { return limits_; }
  const DeviceFeatures& features() const { return features_; }
  const vk::raii::Device& vulkan() const { return device_; }
  const vk::raii::PipelineCache& pipeline_cache() const { return pipeline_cache_.vulkan(); }
  std::uint32_t queue_family() const { return candidate_.queue_family; }
  std::int64_t num_validation_messages() const { return *instance_.num_messages; }

  // Nanoseconds of one timestamp unit, and the mask of its valid bits: 0 without timestamps.
  double timestamp_period_ns() const { return timestamp_period_ns_; }
  std::uint64_t timestamp_mask() const { return timestamp_mask_; }

  // Memory of one of the types in `type_bits`. `mappable`: for staging; else for a Buffer, where
  // the host sees it only if that costs nothing (see is_mappable).
  vk::raii::DeviceMemory Allocate(const vk::MemoryRequirements& requirements, bool mappable) const;
  // `memory` as that of a Buffer, of a type in `type_bits`; needs features().host_memory, and that
  // buffers are mappable. Null where the device does not take it.
  vk::raii::DeviceMemory Import(const LargeMemory& memory, std::uint32_t type_bits) const;
  // Whether Allocate(.., false) gives memory that can be mapped.
  bool buffers_are_mappable() const { return buffers_are_mappable_; }

  // Submits and waits until it has run. `what` is named in the error.
  void Run(const vk::raii::CommandBuffer& commands, const vk::raii::Fence& fence,
           const std::string& what) const;

  // For debuggers and validation messages; nothing without validation.
  template <typename Handle>
  void SetName(const Handle& handle, const std::string& name) const {
    if (!validation_) return;
    using CType = typename Handle::CType;
    device_.setDebugUtilsObjectNameEXT({Handle::objectType,
                                        reinterpret_cast<std::uint64_t>(static_cast<CType>(handle)),
                                        name.c_str()});
  }

  Staging& staging() { return *staging_; }

  // Null where the driver runs all kernels.
  HostThreads* host_threads() const { return host_threads_.get(); }

 private:
  std::optional<std::uint32_t> FindMemoryType(std::uint32_t type_bits,
                                              vk::MemoryPropertyFlags flags) const;

  Instance instance_;
  Candidate candidate_;
  bool validation_;
  DeviceFeatures features_;
  DeviceLimits limits_;
  vk::PhysicalDeviceMemoryProperties memory_properties_;
  bool buffers_are_mappable_ = false;
  double timestamp_period_ns_ = 0;
  std::uint64_t timestamp_mask_ = 0;
  vk::raii::Device device_;
  PipelineCache pipeline_cache_;
  vk::raii::Queue queue_;
  mutable std::mutex queue_mutex_;
  std::unique_ptr<Staging> staging_;
  std::unique_ptr<HostThreads> host_threads_;
};

}  // namespace mono3d
