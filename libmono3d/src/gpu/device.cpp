// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/gpu/device.h"

#include <future>
#include <limits>
#include <utility>

#include "gpu/address_space.h"
#include "gpu/device_handle.h"
#include "gpu/device_internals.h"
#include "gpu/host_kernel.h"
#include "gpu/host_memory.h"
#include "gpu/host_threads.h"
#include "gpu/staging.h"
#include "mono3d/core/thread_priority.h"

namespace mono3d {
namespace {

using Memory = vk::MemoryPropertyFlagBits;

constexpr vk::MemoryPropertyFlags kMapped = Memory::eHostVisible | Memory::eHostCoherent;
// Cached as well: a discrete GPU whose memory is visible but uncached is read at a crawl.
constexpr vk::MemoryPropertyFlags kLocalAndMapped =
    Memory::eDeviceLocal | kMapped | Memory::eHostCached;

std::uint64_t TimestampMask(const Candidate& candidate) {
  const std::uint32_t bits =
      candidate.physical.getQueueFamilyProperties()[candidate.queue_family].timestampValidBits;
  if (bits >= 64) return std::numeric_limits<std::uint64_t>::max();
  return (std::uint64_t{1} << bits) - 1;
}

bool RunsHostKernels() {
#if MONO3D_HAS_AVX2
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt");
#else
  return false;
#endif
}

}  // namespace

Device::Device(Instance instance, Candidate candidate, const DeviceOptions& options,
               HostMemory host_memory)
    : instance_(std::move(instance)),
      candidate_(std::move(candidate)),
      validation_(options.validation),
      features_(QueryFeatures(candidate_.physical)),
      limits_(QueryLimits(candidate_.physical, features_)),
      memory_properties_(candidate_.physical.getMemoryProperties()),
      timestamp_period_ns_(candidate_.physical.getProperties().limits.timestampPeriod),
      timestamp_mask_(TimestampMask(candidate_)),
      device_(CreateLogicalDevice(candidate_.physical, candidate_.queue_family, features_)),
      pipeline_cache_(candidate_.physical, device_),
      queue_(device_.getQueue(candidate_.queue_family, 0)),
      staging_(std::make_unique<Staging>()) {
  buffers_are_mappable_ = host_memory == HostMemory::kMappedIfPossible &&
                          FindMemoryType(~std::uint32_t{0}, kLocalAndMapped).has_value();
  if (options.host_kernels && limits_.is_cpu && buffers_are_mappable_ && RunsHostKernels()) {
    host_threads_ = std::make_unique<HostThreads>(!options.yields);
  }
}

Device::~Device() = default;

std::optional<std::uint32_t> Device::FindMemoryType(std::uint32_t type_bits,
                                                    vk::MemoryPropertyFlags flags) const {
  for (std::uint32_t i = 0; i < memory_properties_.memoryTypeCount; ++i) {
    const bool allowed = (type_bits >> i & 1U) != 0;
    if (allowed && (memory_properties_.memoryTypes[i].propertyFlags & flags) == flags) return i;
  }
  return std::nullopt;
}

vk::raii::DeviceMemory Device::Allocate(const vk::MemoryRequirements& requirements,
                                        bool mappable) const {
  std::optional<std::uint32_t> type;
  if (mappable) {
    type = FindMemoryType(requirements.memoryTypeBits, kMapped | Memory::eHostCached);
    if (!type) type = FindMemoryType(requirements.memoryTypeBits, kMapped);
  } else {
    type = FindMemoryType(requirements.memoryTypeBits,
                          buffers_are_mappable_ ? kLocalAndMapped : Memory::eDeviceLocal);
  }
  if (!type)
    throw Error(
        {"the device has no memory fit for buffers", info().name, {}, {}, ErrorCode::kDevice});
  return device_.allocateMemory({requirements.size, *type});
}

vk::raii::DeviceMemory Device::Import(const LargeMemory& memory, std::uint32_t type_bits) const {
  constexpr auto kOfHost = vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT;
  const vk::MemoryHostPointerPropertiesEXT found =
      device_.getMemoryHostPointerPropertiesEXT(kOfHost, memory.data());
  const std::optional<std::uint32_t> type =
      FindMemoryType(type_bits & found.memoryTypeBits, kLocalAndMapped);
  if (!type) return nullptr;
  const vk::ImportMemoryHostPointerInfoEXT of_host(kOfHost, memory.data());
  vk::MemoryAllocateInfo info(memory.size(), *type);
  info.pNext = &of_host;
  try {
    return device_.allocateMemory(info);
  } catch (const vk::SystemError&) {
    return nullptr;
  }
}

void Device::Run(const vk::raii::CommandBuffer& commands, const vk::raii::Fence& fence,
                 const std::string& what) const {
  RequireAddressSpace(what, kDriverCallBytes);
  const vk::CommandBuffer handle = *commands;
  const vk::SubmitInfo submit({}, {}, handle);
  device_.resetFences(*fence);
  {
    const std::scoped_lock lock(queue_mutex_);
    queue_.submit(submit, *fence);
  }
  constexpr std::uint64_t kForever = std::numeric_limits<std::uint64_t>::max();
  const vk::Result result = device_.waitForFences(*fence, VK_TRUE, kForever);
  if (result != vk::Result::eSuccess) throw MakeVulkanError(info().name, what, result);
}

std::shared_ptr<Device> OpenDeviceHere(const DeviceOptions& options, HostMemory host_memory) {
  RequireAddressSpace("opening the device", kOpeningBytes);
  Instance instance = CreateInstance(options.validation);
  std::vector<Candidate> candidates = ListCandidates(instance);
  Candidate& chosen = candidates[ChooseCandidate(candidates, options.device)];
  const std::string name = chosen.info.name;
  return CallVulkan(name, "opening the device", [&] {
    return std::make_shared<Device>(std::move(instance), std::move(chosen), options, host_memory);
  });
}

std::shared_ptr<Device> OpenDeviceWith(const DeviceOptions& options, HostMemory host_memory) {
  if (!options.yields) return OpenDeviceHere(options, host_memory);
  // The driver's threads have the priority of the one that opens the device.
  return std::async(std::launch::async,
                    [&] {
                      LowerThreadPriority(ThreadPriority::kTenth);
                      return OpenDeviceHere(options, host_memory);
                    })
      .get();
}

std::shared_ptr<Device> OpenDevice(const DeviceOptions& options) {
  return OpenDeviceWith(options, HostMemory::kMappedIfPossible);
}

std::vector<DeviceInfo> ListDevices() {
  const Instance instance = CreateInstance(false);
  std::vector<DeviceInfo> devices;
  for (const Candidate& candidate : ListCandidates(instance)) devices.push_back(candidate.info);
  return devices;
}

const DeviceInfo& Info(const Device& device) { return device.info(); }

const DeviceLimits& Limits(const Device& device) { return device.limits(); }

std::int64_t NumValidationMessages(const Device& device) {
  return device.num_validation_messages();
}

}  // namespace mono3d
