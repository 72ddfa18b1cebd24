// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <mutex>

#include "gpu/vulkan_calls.h"

namespace mono3d {

class Device;

// Moves data between the host and memory that it cannot see, through one mapped buffer that is made
// at the first transfer and kept. Each call waits until the data has arrived. Thread-safe.
class Staging {
 public:
  void Upload(const Device& device, vk::Buffer to, std::size_t to_offset, const void* data,
              std::size_t size_bytes);
  void Download(const Device& device, vk::Buffer from, std::size_t from_offset, void* data,
                std::size_t size_bytes);

 private:
  void Prepare(const Device& device);
  void CopyAndWait(const Device& device, vk::Buffer from, vk::Buffer to,
                   const vk::BufferCopy& region);

  std::mutex mutex_;
  vk::raii::DeviceMemory memory_ = nullptr;
  vk::raii::Buffer buffer_ = nullptr;
  std::byte* mapped_ = nullptr;
  vk::raii::CommandPool command_pool_ = nullptr;
  vk::raii::CommandBuffer commands_ = nullptr;
  vk::raii::Fence fence_ = nullptr;
};

}  // namespace mono3d
