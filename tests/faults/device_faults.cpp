// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A Vulkan layer: counts the calls that may fail and lets one of them fail (see fault_point.h), the
// kinds are the names of the functions. What makes something runs out of the device's memory; what
// works on the queue loses the device, and the device stays lost. MONO3D_FAULT_HIDES_MEMORY: the
// device's memory is hidden from the host, as that of many GPUs is.

#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <utility>

#include "faults/fault_point.h"

namespace {

using mono3d::faults::FaultPoint;

enum class Effect { kOutOfDeviceMemory, kOutOfHostMemory, kMapFails, kDeviceLost };

struct Call {
  const char* name;
  Effect effect;
};

constexpr std::array kCalls = {
    Call{"vkAllocateMemory", Effect::kOutOfDeviceMemory},
    Call{"vkBindBufferMemory", Effect::kOutOfDeviceMemory},
    Call{"vkMapMemory", Effect::kMapFails},
    Call{"vkCreateBuffer", Effect::kOutOfDeviceMemory},
    Call{"vkCreateBufferView", Effect::kOutOfHostMemory},
    Call{"vkCreateShaderModule", Effect::kOutOfHostMemory},
    Call{"vkCreateDescriptorSetLayout", Effect::kOutOfHostMemory},
    Call{"vkCreatePipelineLayout", Effect::kOutOfHostMemory},
    Call{"vkCreatePipelineCache", Effect::kOutOfHostMemory},
    Call{"vkGetPipelineCacheData", Effect::kOutOfHostMemory},
    Call{"vkCreateComputePipelines", Effect::kOutOfDeviceMemory},
    Call{"vkCreateDescriptorPool", Effect::kOutOfDeviceMemory},
    Call{"vkAllocateDescriptorSets", Effect::kOutOfDeviceMemory},
    Call{"vkCreateCommandPool", Effect::kOutOfDeviceMemory},
    Call{"vkResetCommandPool", Effect::kOutOfDeviceMemory},
    Call{"vkAllocateCommandBuffers", Effect::kOutOfDeviceMemory},
    Call{"vkBeginCommandBuffer", Effect::kOutOfDeviceMemory},
    Call{"vkEndCommandBuffer", Effect::kOutOfDeviceMemory},
    Call{"vkCreateFence", Effect::kOutOfDeviceMemory},
    Call{"vkResetFences", Effect::kOutOfDeviceMemory},
    Call{"vkCreateQueryPool", Effect::kOutOfDeviceMemory},
    Call{"vkQueueSubmit", Effect::kDeviceLost},
    Call{"vkWaitForFences", Effect::kDeviceLost},
    Call{"vkGetQueryPoolResults", Effect::kDeviceLost},
};

constexpr std::size_t kNumCalls = kCalls.size();
constexpr std::size_t kCreateInstance = kNumCalls;
constexpr std::size_t kListDevices = kNumCalls + 1;
constexpr std::size_t kCreateDevice = kNumCalls + 2;

template <std::size_t... kIndices>
constexpr std::array<FaultPoint, kNumCalls + 3> MakePoints(std::index_sequence<kIndices...>) {
  return {FaultPoint(kCalls[kIndices].name)..., FaultPoint("vkCreateInstance"),
          FaultPoint("vkEnumeratePhysicalDevices"), FaultPoint("vkCreateDevice")};
}

constinit std::array<FaultPoint, kNumCalls + 3> device_points =
    MakePoints(std::make_index_sequence<kNumCalls>());
constinit std::array<PFN_vkVoidFunction, kNumCalls> next_calls{};
constinit std::atomic<bool> is_lost = false;
PFN_vkGetInstanceProcAddr next_instance_function = nullptr;
PFN_vkGetDeviceProcAddr next_device_function = nullptr;
PFN_vkEnumeratePhysicalDevices next_list_devices = nullptr;
PFN_vkGetPhysicalDeviceMemoryProperties next_describe_memory = nullptr;
VkInstance latest_instance = VK_NULL_HANDLE;

[[gnu::destructor]] void End() { mono3d::faults::ReportCounts(device_points); }

constexpr VkResult ResultOf(Effect effect) {
  switch (effect) {
    case Effect::kOutOfDeviceMemory:
      return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    case Effect::kOutOfHostMemory:
      return VK_ERROR_OUT_OF_HOST_MEMORY;
    case Effect::kMapFails:
      return VK_ERROR_MEMORY_MAP_FAILED;
    case Effect::kDeviceLost:
      break;
  }
  return VK_ERROR_DEVICE_LOST;
}

// The layer's own form of the function `kIndex`, of the type of its first argument.
template <std::size_t kIndex, typename Function>
struct Hook;

template <std::size_t kIndex, typename... Arguments>
struct Hook<kIndex, VkResult(VKAPI_PTR*)(Arguments...)> {
  static VKAPI_ATTR VkResult VKAPI_CALL Run(Arguments... arguments) {
    constexpr Effect kEffect = kCalls[kIndex].effect;
    const bool is_due = device_points[kIndex].IsDue();
    using Next = VkResult(VKAPI_PTR*)(Arguments...);
    const auto next = reinterpret_cast<Next>(next_calls[kIndex]);
    // A device that is lost does nothing any more: what it was given is not worked at behind the
    // back of who makes away with it.
    if (is_due && std::string_view(kCalls[kIndex].name) == "vkWaitForFences") next(arguments...);
    if (is_due && kEffect == Effect::kDeviceLost) is_lost = true;
    if (is_due || (is_lost && kEffect == Effect::kDeviceLost)) return ResultOf(kEffect);
    return next(arguments...);
  }
};

constexpr std::size_t IndexOf(const char* name) {
  for (std::size_t i = 0; i < kNumCalls; ++i) {
    if (std::string_view(kCalls[i].name) == name) return i;
  }
  return kNumCalls;
}

#define MONO3D_HOOK(name)                                                                \
  if (std::strcmp(wanted, #name) == 0) {                                                 \
    return reinterpret_cast<PFN_vkVoidFunction>(&Hook<IndexOf(#name), PFN_##name>::Run); \
  }

PFN_vkVoidFunction HookOf(const char* wanted) {
  MONO3D_HOOK(vkAllocateMemory)
  MONO3D_HOOK(vkBindBufferMemory)
  MONO3D_HOOK(vkMapMemory)
  MONO3D_HOOK(vkCreateBuffer)
  MONO3D_HOOK(vkCreateBufferView)
  MONO3D_HOOK(vkCreateShaderModule)
  MONO3D_HOOK(vkCreateDescriptorSetLayout)
  MONO3D_HOOK(vkCreatePipelineLayout)
  MONO3D_HOOK(vkCreatePipelineCache)
  MONO3D_HOOK(vkGetPipelineCacheData)
  MONO3D_HOOK(vkCreateComputePipelines)
  MONO3D_HOOK(vkCreateDescriptorPool)
  MONO3D_HOOK(vkAllocateDescriptorSets)
  MONO3D_HOOK(vkCreateCommandPool)
  MONO3D_HOOK(vkResetCommandPool)
  MONO3D_HOOK(vkAllocateCommandBuffers)
  MONO3D_HOOK(vkBeginCommandBuffer)
  MONO3D_HOOK(vkEndCommandBuffer)
  MONO3D_HOOK(vkCreateFence)
  MONO3D_HOOK(vkResetFences)
  MONO3D_HOOK(vkCreateQueryPool)
  MONO3D_HOOK(vkQueueSubmit)
  MONO3D_HOOK(vkWaitForFences)
  MONO3D_HOOK(vkGetQueryPoolResults)
  return nullptr;
}

PFN_vkVoidFunction DeviceFunction(PFN_vkVoidFunction next, const char* name) {
  const PFN_vkVoidFunction hook = HookOf(name);
  if (hook == nullptr || next == nullptr) return next;
  next_calls[IndexOf(name)] = next;
  return hook;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL GetDeviceFunction(VkDevice device, const char* name) {
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0) {
    return reinterpret_cast<PFN_vkVoidFunction>(&GetDeviceFunction);
  }
  return DeviceFunction(next_device_function(device, name), name);
}

template <typename Link, typename CreateInfo>
Link* FindLink(const CreateInfo* info, VkStructureType type) {
  for (const auto* it = static_cast<const Link*>(info->pNext); it != nullptr;
       it = static_cast<const Link*>(it->pNext)) {
    if (it->sType == type && it->function == VK_LAYER_LINK_INFO) return const_cast<Link*>(it);
  }
  return nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL CreateInstance(const VkInstanceCreateInfo* info,
                                              const VkAllocationCallbacks* allocator,
                                              VkInstance* instance) {
  auto* link =
      FindLink<VkLayerInstanceCreateInfo>(info, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  if (device_points[kCreateInstance].IsDue()) return VK_ERROR_OUT_OF_HOST_MEMORY;
  next_instance_function = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create = reinterpret_cast<PFN_vkCreateInstance>(
      next_instance_function(VK_NULL_HANDLE, "vkCreateInstance"));
  const VkResult result = create(info, allocator, instance);
  if (result != VK_SUCCESS) return result;
  latest_instance = *instance;
  // Once the instance is complete, the loader gives the first layer's functions for these.
  next_list_devices = reinterpret_cast<PFN_vkEnumeratePhysicalDevices>(
      next_instance_function(*instance, "vkEnumeratePhysicalDevices"));
  next_describe_memory = reinterpret_cast<PFN_vkGetPhysicalDeviceMemoryProperties>(
      next_instance_function(*instance, "vkGetPhysicalDeviceMemoryProperties"));
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL ListDevices(VkInstance instance, std::uint32_t* count,
                                           VkPhysicalDevice* devices) {
  if (device_points[kListDevices].IsDue()) return VK_ERROR_INITIALIZATION_FAILED;
  return next_list_devices(instance, count, devices);
}

// Memory that is not cached is not mapped, but for what is copied through it.
VKAPI_ATTR void VKAPI_CALL DescribeMemory(VkPhysicalDevice physical,
                                          VkPhysicalDeviceMemoryProperties* properties) {
  next_describe_memory(physical, properties);
  if (std::getenv("MONO3D_FAULT_HIDES_MEMORY") == nullptr) return;
  for (VkMemoryType& type : properties->memoryTypes) {
    type.propertyFlags &= ~static_cast<VkMemoryPropertyFlags>(VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  }
}

VKAPI_ATTR VkResult VKAPI_CALL CreateDevice(VkPhysicalDevice physical,
                                            const VkDeviceCreateInfo* info,
                                            const VkAllocationCallbacks* allocator,
                                            VkDevice* device) {
  auto* link = FindLink<VkLayerDeviceCreateInfo>(info, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  if (device_points[kCreateDevice].IsDue()) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  const auto instance_function = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  next_device_function = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create =
      reinterpret_cast<PFN_vkCreateDevice>(instance_function(latest_instance, "vkCreateDevice"));
  return create(physical, info, allocator, device);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL GetInstanceFunction(VkInstance instance,
                                                             const char* name) {
  const std::array own = {
      std::pair("vkGetInstanceProcAddr",
                reinterpret_cast<PFN_vkVoidFunction>(&GetInstanceFunction)),
      std::pair("vkCreateInstance", reinterpret_cast<PFN_vkVoidFunction>(&CreateInstance)),
      std::pair("vkEnumeratePhysicalDevices", reinterpret_cast<PFN_vkVoidFunction>(&ListDevices)),
      std::pair("vkGetPhysicalDeviceMemoryProperties",
                reinterpret_cast<PFN_vkVoidFunction>(&DescribeMemory)),
      std::pair("vkCreateDevice", reinterpret_cast<PFN_vkVoidFunction>(&CreateDevice)),
      std::pair("vkGetDeviceProcAddr", reinterpret_cast<PFN_vkVoidFunction>(&GetDeviceFunction))};
  for (const auto& [own_name, function] : own) {
    if (std::strcmp(name, own_name) == 0) return function;
  }
  if (instance == VK_NULL_HANDLE) return nullptr;
  return DeviceFunction(next_instance_function(instance, name), name);
}

}  // namespace

extern "C" VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* layer) {
  constexpr std::uint32_t kVersion = 2;
  if (layer->loaderLayerInterfaceVersion < kVersion) return VK_ERROR_INITIALIZATION_FAILED;
  layer->loaderLayerInterfaceVersion = kVersion;
  layer->pfnGetInstanceProcAddr = GetInstanceFunction;
  layer->pfnGetDeviceProcAddr = GetDeviceFunction;
  layer->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}
