// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <utility>
#include <vulkan/vulkan_raii.hpp>

#include "mono3d/core/error.h"

namespace mono3d {

// The Error for a failed Vulkan call: `where` is the device, kernel or buffer it was about.
Error MakeVulkanError(const std::string& where, const std::string& what, vk::Result result);

// Runs `call`; a Vulkan failure inside comes out as Error. vk::raii checks every result in every
// build type and throws vk::SystemError, which must not leave the module.
template <typename Call>
decltype(auto) CallVulkan(const std::string& where, const std::string& what, Call&& call) {
  try {
    return std::forward<Call>(call)();
  } catch (const vk::SystemError& error) {
    throw MakeVulkanError(where, what, static_cast<vk::Result>(error.code().value()));
  }
}

}  // namespace mono3d
