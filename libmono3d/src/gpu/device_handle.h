// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>

#include "mono3d/gpu/device.h"

namespace mono3d {

// What a device can do, as it says itself. Every limit of a stage is checked against these.
struct DeviceLimits {
  std::uint64_t max_storage_buffer_bytes = 0;   // largest Buffer
  std::uint64_t max_texel_buffer_elements = 0;  // largest Buffer read as imageBuffer, in texels
  std::uint32_t max_push_constant_bytes = 0;
  std::uint32_t max_shared_memory_bytes = 0;
  std::uint32_t max_workgroup_invocations = 0;
  std::uint32_t max_storage_buffers = 0;  // std430 bindings of one kernel
  std::uint32_t max_texel_buffers = 0;    // imageBuffer bindings of one kernel
  std::array<std::uint32_t, 3> max_workgroup_size{};
  std::array<std::uint32_t, 3> max_workgroup_count{};
  std::uint64_t memory_bytes = 0;   // of its largest heap of its own
  std::uint32_t subgroup_size = 0;  // every kernel with subgroup operations runs with this size
  bool is_cpu = false;              // lavapipe: volumes path-major, no tiles
  bool has_int64 = false;
  bool has_int64_atomics = false;  // on 64-bit integers in storage buffers
};

const DeviceLimits& Limits(const Device& device);

// Messages of the validation layer since the device was opened; 0 without
// DeviceOptions::validation.
std::int64_t NumValidationMessages(const Device& device);

}  // namespace mono3d
