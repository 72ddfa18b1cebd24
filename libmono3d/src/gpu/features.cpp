// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/features.h"

#include <spirv_cross_c.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace mono3d {
namespace {

bool Has13(const vk::raii::PhysicalDevice& physical) {
  return physical.getProperties().apiVersion >= VK_API_VERSION_1_3;
}

bool HasExtension(const vk::raii::PhysicalDevice& physical, std::string_view name) {
  return std::ranges::any_of(physical.enumerateDeviceExtensionProperties(),
                             [&](const vk::ExtensionProperties& extension) {
                               return extension.extensionName.data() == name;
                             });
}

std::optional<std::string> Unless(bool present, const char* name) {
  if (present) return std::nullopt;
  return name;
}

}  // namespace

DeviceFeatures QueryFeatures(const vk::raii::PhysicalDevice& physical) {
  const auto chain =
      physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>();
  const vk::PhysicalDeviceFeatures& core = chain.get<vk::PhysicalDeviceFeatures2>().features;
  const auto subgroup =
      physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
          .get<vk::PhysicalDeviceSubgroupProperties>();
  DeviceFeatures result;
  result.int64 = core.shaderInt64;
  result.extended_image_formats = core.shaderStorageImageExtendedFormats;
  result.buffer_int64_atomics =
      chain.get<vk::PhysicalDeviceVulkan12Features>().shaderBufferInt64Atomics;
  if (subgroup.supportedStages & vk::ShaderStageFlagBits::eCompute) {
    result.subgroup_operations = subgroup.supportedOperations;
  }
  result.host_memory = physical.getProperties().deviceType == vk::PhysicalDeviceType::eCpu &&
                       HasExtension(physical, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);
  if (Has13(physical)) {
    const auto chain13 =
        physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan13Features>();
    const auto& features13 = chain13.get<vk::PhysicalDeviceVulkan13Features>();
    const auto control = physical
                             .getProperties2<vk::PhysicalDeviceProperties2,
                                             vk::PhysicalDeviceSubgroupSizeControlProperties>()
                             .get<vk::PhysicalDeviceSubgroupSizeControlProperties>();
    result.subgroup_size_control =
        features13.subgroupSizeControl &&
        (control.requiredSubgroupSizeStages & vk::ShaderStageFlagBits::eCompute);
    result.full_subgroups = result.subgroup_size_control && features13.computeFullSubgroups;
  }
  return result;
}

DeviceLimits QueryLimits(const vk::raii::PhysicalDevice& physical, const DeviceFeatures& features) {
  const auto chain =
      physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties,
                              vk::PhysicalDeviceMaintenance3Properties>();
  const auto& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
  const vk::PhysicalDeviceLimits& limits = properties.limits;
  DeviceLimits result;
  // A buffer is bound whole and lies in one allocation.
  result.max_storage_buffer_bytes = std::min<std::uint64_t>(
      limits.maxStorageBufferRange,
      chain.get<vk::PhysicalDeviceMaintenance3Properties>().maxMemoryAllocationSize);
  result.max_texel_buffer_elements = limits.maxTexelBufferElements;
  result.max_push_constant_bytes = limits.maxPushConstantsSize;
  result.max_shared_memory_bytes = limits.maxComputeSharedMemorySize;
  result.max_workgroup_invocations = limits.maxComputeWorkGroupInvocations;
  result.max_storage_buffers = limits.maxPerStageDescriptorStorageBuffers;
  result.max_texel_buffers = limits.maxPerStageDescriptorStorageImages;
  result.max_workgroup_size = limits.maxComputeWorkGroupSize;
  result.max_workgroup_count = limits.maxComputeWorkGroupCount;
  const vk::PhysicalDeviceMemoryProperties memory = physical.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    const vk::MemoryHeap& heap = memory.memoryHeaps[i];
    if (!(heap.flags & vk::MemoryHeapFlagBits::eDeviceLocal)) continue;
    result.memory_bytes = std::max<std::uint64_t>(result.memory_bytes, heap.size);
  }
  result.subgroup_size = chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize;
  result.is_cpu = properties.deviceType == vk::PhysicalDeviceType::eCpu;
  result.has_int64 = features.int64;
  result.has_int64_atomics = features.int64 && features.buffer_int64_atomics;
  return result;
}

vk::raii::Device CreateLogicalDevice(const vk::raii::PhysicalDevice& physical,
                                     std::uint32_t queue_family, const DeviceFeatures& features) {
  vk::PhysicalDeviceFeatures2 core;
  core.features.shaderInt64 = features.int64;
  core.features.shaderStorageImageExtendedFormats = features.extended_image_formats;
  vk::PhysicalDeviceVulkan12Features features12;
  features12.shaderBufferInt64Atomics = features.buffer_int64_atomics;
  core.pNext = &features12;
  vk::PhysicalDeviceVulkan13Features features13;
  features13.subgroupSizeControl = features.subgroup_size_control;
  features13.computeFullSubgroups = features.full_subgroups;
  if (Has13(physical)) features12.pNext = &features13;

  const float priority = 1.0F;
  const vk::DeviceQueueCreateInfo queue({}, queue_family, 1, &priority);
  std::vector<const char*> extensions;
  if (features.host_memory) extensions.push_back(VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);
  vk::DeviceCreateInfo info({}, queue, {}, extensions);
  info.pNext = &core;
  return physical.createDevice(info);
}

std::optional<std::string> MissingCapability(const DeviceFeatures& features,
                                             std::uint32_t capability) {
  using Subgroup = vk::SubgroupFeatureFlagBits;
  const auto has = [&](Subgroup operation) {
    return static_cast<bool>(features.subgroup_operations & operation);
  };
  switch (capability) {
    case SpvCapabilityMatrix:
    case SpvCapabilityShader:
    case SpvCapabilityImageBuffer:
    case SpvCapabilityImageQuery:
      return std::nullopt;
    case SpvCapabilityInt64:
      return Unless(features.int64, "64-bit integers");
    case SpvCapabilityInt64Atomics:
      return Unless(features.buffer_int64_atomics, "64-bit atomics");
    case SpvCapabilityStorageImageExtendedFormats:
      return Unless(features.extended_image_formats, "extended image formats");
    case SpvCapabilityGroupNonUniform:
      return Unless(has(Subgroup::eBasic), "subgroups");
    case SpvCapabilityGroupNonUniformVote:
      return Unless(has(Subgroup::eVote), "subgroup vote");
    case SpvCapabilityGroupNonUniformArithmetic:
      return Unless(has(Subgroup::eArithmetic), "subgroup arithmetic");
    case SpvCapabilityGroupNonUniformBallot:
      return Unless(has(Subgroup::eBallot), "subgroup ballot");
    case SpvCapabilityGroupNonUniformShuffle:
      return Unless(has(Subgroup::eShuffle), "subgroup shuffle");
    case SpvCapabilityGroupNonUniformShuffleRelative:
      return Unless(has(Subgroup::eShuffleRelative), "relative subgroup shuffle");
    case SpvCapabilityGroupNonUniformClustered:
      return Unless(has(Subgroup::eClustered), "clustered subgroup operations");
    case SpvCapabilityGroupNonUniformQuad:
      return Unless(has(Subgroup::eQuad), "subgroup quads");
    default:
      return "SPIR-V capability " + std::to_string(capability);
  }
}

}  // namespace mono3d
