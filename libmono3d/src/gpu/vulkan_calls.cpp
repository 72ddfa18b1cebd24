// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/vulkan_calls.h"

namespace mono3d {
namespace {

std::string Meaning(vk::Result result) {
  switch (result) {
    case vk::Result::eErrorDeviceLost:
      return "device lost: the driver gave up, often because a kernel ran too long; smaller images "
             "help, or another device";
    case vk::Result::eErrorOutOfDeviceMemory:
      return "out of device memory";
    case vk::Result::eErrorOutOfHostMemory:
      return "out of host memory";
    default:
      return vk::to_string(result);
  }
}

ErrorCode CodeOf(vk::Result result) {
  const bool is_memory =
      result == vk::Result::eErrorOutOfDeviceMemory || result == vk::Result::eErrorOutOfHostMemory;
  return is_memory ? ErrorCode::kOutOfMemory : ErrorCode::kDevice;
}

}  // namespace

Error MakeVulkanError(const std::string& where, const std::string& what, vk::Result result) {
  return Error({what + " failed: " + Meaning(result), where, {}, {}, CodeOf(result)});
}

}  // namespace mono3d
