// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpu/vulkan_calls.h"
#include "mono3d/gpu/device.h"

namespace mono3d {

// The connection to the Vulkan loader, with the validation layer's messages when asked for.
struct Instance {
  vk::raii::Context context;
  vk::raii::Instance instance = nullptr;
  std::unique_ptr<std::atomic<std::int64_t>> num_messages;
  vk::raii::DebugUtilsMessengerEXT messenger = nullptr;
};

// Throws Error that names the Debian package to install when there is no loader, no driver or, with
// `validation`, no validation layer.
Instance CreateInstance(bool validation);

// A device that this library can use: Vulkan 1.2 and a queue that computes.
struct Candidate {
  vk::raii::PhysicalDevice physical;
  std::uint32_t queue_family = 0;
  DeviceInfo info;
};

// Best first, as ListDevices(). Throws Error when there is none.
std::vector<Candidate> ListCandidates(const Instance& instance);

// The one that DeviceOptions::device means; throws UsageError when none fits.
std::size_t ChooseCandidate(const std::vector<Candidate>& candidates, const std::string& wanted);

}  // namespace mono3d
