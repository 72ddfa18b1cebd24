// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/staging.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "gpu/device_internals.h"

namespace mono3d {
namespace {

// Large enough that the fixed cost of a submission is small beside the copy, small enough to keep.
constexpr std::size_t kStagingBytes = std::size_t{16} << 20;

}  // namespace

void Staging::Prepare(const Device& device) {
  if (mapped_ != nullptr) return;
  const vk::raii::Device& vulkan = device.vulkan();
  const auto usage = vk::BufferUsageFlagBits::eTransferSrc | vk::BufferUsageFlagBits::eTransferDst;
  buffer_ = vulkan.createBuffer({{}, kStagingBytes, usage});
  device.SetName(*buffer_, "gpu/staging");
  memory_ = device.Allocate(buffer_.getMemoryRequirements(), true);
  buffer_.bindMemory(*memory_, 0);
  command_pool_ =
      vulkan.createCommandPool({vk::CommandPoolCreateFlagBits::eTransient, device.queue_family()});
  commands_ = std::move(
      vulkan.allocateCommandBuffers({*command_pool_, vk::CommandBufferLevel::ePrimary, 1}).front());
  fence_ = vulkan.createFence({});
  mapped_ = static_cast<std::byte*>(memory_.mapMemory(0, kStagingBytes));
}

void Staging::CopyAndWait(const Device& device, vk::Buffer from, vk::Buffer to,
                          const vk::BufferCopy& region) {
  using Stage = vk::PipelineStageFlagBits;
  using Access = vk::AccessFlagBits;
  command_pool_.reset();
  commands_.begin({vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
  const vk::MemoryBarrier before(Access::eShaderWrite | Access::eTransferWrite,
                                 Access::eTransferRead | Access::eTransferWrite);
  commands_.pipelineBarrier(Stage::eComputeShader | Stage::eTransfer, Stage::eTransfer, {}, before,
                            {}, {});
  commands_.copyBuffer(from, to, region);
  const vk::MemoryBarrier after(Access::eTransferWrite, Access::eHostRead);
  commands_.pipelineBarrier(Stage::eTransfer, Stage::eHost, {}, after, {}, {});
  commands_.end();
  device.Run(commands_, fence_, "a transfer");
}

void Staging::Upload(const Device& device, vk::Buffer to, std::size_t to_offset, const void* data,
                     std::size_t size_bytes) {
  const std::scoped_lock lock(mutex_);
  Prepare(device);
  for (std::size_t done = 0; done < size_bytes; done += kStagingBytes) {
    const std::size_t part = std::min(kStagingBytes, size_bytes - done);
    std::memcpy(mapped_, static_cast<const std::byte*>(data) + done, part);
    CopyAndWait(device, *buffer_, to, {0, to_offset + done, part});
  }
}

void Staging::Download(const Device& device, vk::Buffer from, std::size_t from_offset, void* data,
                       std::size_t size_bytes) {
  const std::scoped_lock lock(mutex_);
  Prepare(device);
  for (std::size_t done = 0; done < size_bytes; done += kStagingBytes) {
    const std::size_t part = std::min(kStagingBytes, size_bytes - done);
    CopyAndWait(device, from, *buffer_, {from_offset + done, 0, part});
    std::memcpy(static_cast<std::byte*>(data) + done, mapped_, part);
  }
}

}  // namespace mono3d
