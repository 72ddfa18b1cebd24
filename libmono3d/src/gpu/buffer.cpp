// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/buffer.h"

#include <cstring>
#include <utility>

#include "gpu/allocation_hook.h"
#include "gpu/buffer_memory.h"
#include "gpu/staging.h"

namespace mono3d {
namespace {

constexpr vk::BufferUsageFlags kUsage =
    vk::BufferUsageFlagBits::eStorageBuffer | vk::BufferUsageFlagBits::eStorageTexelBuffer |
    vk::BufferUsageFlagBits::eTransferSrc | vk::BufferUsageFlagBits::eTransferDst;

AllocationHook& Hook() {
  static AllocationHook hook;
  return hook;
}

std::size_t RoundUp(std::size_t size_bytes) {
  return (size_bytes + kBufferGranularityBytes - 1) / kBufferGranularityBytes *
         kBufferGranularityBytes;
}

void CheckSize(const Device& device, const std::string& name, std::size_t size_bytes) {
  if (size_bytes == 0)
    throw Error(
        {"a buffer needs a size", name, "at least 1 byte", "0", ErrorCode::kInvalidArgument});
  const std::uint64_t limit = device.limits().max_storage_buffer_bytes;
  if (size_bytes > limit || RoundUp(size_bytes) > limit) {
    throw Error({"the buffer is larger than " + device.info().name + " can bind", name,
                 "at most " + std::to_string(limit) + " bytes", std::to_string(size_bytes),
                 ErrorCode::kUnsupported});
  }
}

// Smaller ones lie in the driver's heap, beside others.
constexpr std::size_t kLargeBytes = std::size_t{1} << 20;

// Where the device is a processor: in memory of ours, on large pages. False where that cannot be.
bool AllocateOnLargePages(BufferMemory& memory) {
  const Device& device = *memory.device;
  if (!device.features().host_memory || !device.buffers_are_mappable()) return false;
  if (memory.allocated_bytes < kLargeBytes) return false;
  memory.host = LargeMemory(memory.allocated_bytes);
  if (memory.host.data() == nullptr) return false;
  const vk::ExternalMemoryBufferCreateInfo of_host(
      vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT);
  vk::BufferCreateInfo info({}, memory.allocated_bytes, kUsage);
  info.pNext = &of_host;
  memory.buffer = device.vulkan().createBuffer(info);
  const vk::MemoryRequirements requirements = memory.buffer.getMemoryRequirements();
  if (requirements.size > memory.host.size()) return false;
  memory.memory = device.Import(memory.host, requirements.memoryTypeBits);
  return *memory.memory != vk::DeviceMemory();
}

void Allocate(BufferMemory& memory) {
  const Device& device = *memory.device;
  if (!AllocateOnLargePages(memory)) {
    memory.host = LargeMemory();
    memory.buffer = device.vulkan().createBuffer({{}, memory.allocated_bytes, kUsage});
    memory.memory = device.Allocate(memory.buffer.getMemoryRequirements(), false);
  }
  device.SetName(*memory.buffer, memory.name);
  memory.buffer.bindMemory(*memory.memory, 0);
  if (!device.buffers_are_mappable()) return;
  memory.mapped = static_cast<std::byte*>(memory.memory.mapMemory(0, VK_WHOLE_SIZE));
}

void CheckTransfer(const BufferMemory* memory, std::size_t size_bytes, std::size_t offset_bytes) {
  if (memory == nullptr)
    throw Error("transfer to or from an empty buffer", ErrorCode::kInvalidArgument);
  if (offset_bytes <= memory->size_bytes && size_bytes <= memory->size_bytes - offset_bytes) return;
  throw Error({"the transfer leaves the buffer", memory->name,
               std::to_string(memory->size_bytes) + " bytes",
               std::to_string(size_bytes) + " bytes at " + std::to_string(offset_bytes),
               ErrorCode::kInvalidArgument});
}

}  // namespace

void SetAllocationHook(AllocationHook hook) { Hook() = std::move(hook); }

vk::BufferView TexelView(BufferMemory& memory, vk::Format format, std::size_t texel_bytes) {
  const auto found = memory.views.find(format);
  if (found != memory.views.end()) return *found->second;
  const std::size_t num_texels = memory.allocated_bytes / texel_bytes;
  const std::uint64_t limit = memory.device->limits().max_texel_buffer_elements;
  if (num_texels > limit) {
    throw Error({"the buffer has more texels than " + memory.device->info().name + " can address",
                 memory.name, "at most " + std::to_string(limit), std::to_string(num_texels),
                 ErrorCode::kUnsupported});
  }
  vk::raii::BufferView view = CallVulkan(memory.name, "making a texel view", [&] {
    return memory.device->vulkan().createBufferView({{}, *memory.buffer, format, 0, VK_WHOLE_SIZE});
  });
  memory.device->SetName(*view, memory.name);
  return *memory.views.emplace(format, std::move(view)).first->second;
}

Buffer::Buffer(std::shared_ptr<Device> device, std::size_t size_bytes, std::string name) {
  CheckSize(*device, name, size_bytes);
  if (Hook()) Hook()(size_bytes, name);
  auto memory = std::make_shared<BufferMemory>();
  memory->device = std::move(device);
  memory->name = std::move(name);
  memory->size_bytes = size_bytes;
  memory->allocated_bytes = RoundUp(size_bytes);
  CallVulkan(memory->name, "allocating " + std::to_string(size_bytes) + " bytes",
             [&] { Allocate(*memory); });
  memory_ = std::move(memory);
}

std::size_t Buffer::size_bytes() const { return memory_ ? memory_->size_bytes : 0; }

std::byte* Buffer::mapped() const { return memory_ ? memory_->mapped : nullptr; }

const std::string& Buffer::name() const {
  static const std::string kEmpty = "empty buffer";
  return memory_ ? memory_->name : kEmpty;
}

void Buffer::UploadBytes(const void* data, std::size_t size_bytes, std::size_t offset_bytes) {
  if (size_bytes == 0) return;
  CheckTransfer(memory_.get(), size_bytes, offset_bytes);
  if (memory_->mapped != nullptr) {
    std::memcpy(memory_->mapped + offset_bytes, data, size_bytes);
    return;
  }
  Device& device = *memory_->device;
  CallVulkan(name(), "the upload", [&] {
    device.staging().Upload(device, *memory_->buffer, offset_bytes, data, size_bytes);
  });
}

void Buffer::DownloadBytes(void* data, std::size_t size_bytes, std::size_t offset_bytes) const {
  if (size_bytes == 0) return;
  CheckTransfer(memory_.get(), size_bytes, offset_bytes);
  if (memory_->mapped != nullptr) {
    std::memcpy(data, memory_->mapped + offset_bytes, size_bytes);
    return;
  }
  Device& device = *memory_->device;
  CallVulkan(name(), "the download", [&] {
    device.staging().Download(device, *memory_->buffer, offset_bytes, data, size_bytes);
  });
}

}  // namespace mono3d
