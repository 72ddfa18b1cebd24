// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gpu/device_handle.h"
#include "gpu/vulkan_calls.h"

namespace mono3d {

// What of a device's optional abilities this library turns on, where present.
struct DeviceFeatures {
  bool int64 = false;
  bool buffer_int64_atomics = false;
  bool extended_image_formats = false;
  bool subgroup_size_control = false;  // a pipeline may demand its subgroup size
  bool full_subgroups = false;
  bool host_memory = false;  // of a processor: its memory may be what the host has already
  vk::SubgroupFeatureFlags subgroup_operations;  // in compute shaders
};

DeviceFeatures QueryFeatures(const vk::raii::PhysicalDevice& physical);

DeviceLimits QueryLimits(const vk::raii::PhysicalDevice& physical, const DeviceFeatures& features);

// A device with one queue of the family and exactly `features` turned on.
vk::raii::Device CreateLogicalDevice(const vk::raii::PhysicalDevice& physical,
                                     std::uint32_t queue_family, const DeviceFeatures& features);

// The name of a capability (SpvCapability) that a shader declares and `features` lack; none if it
// can be used.
std::optional<std::string> MissingCapability(const DeviceFeatures& features,
                                             std::uint32_t capability);

}  // namespace mono3d
