// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace mono3d {

// The image formats that a texel buffer may have: those that every Vulkan device can store. (A
// shader that names one of two components also needs "extended image formats", DeviceFeatures.)
enum class TexelFormat { kR32ui, kR32i, kR32f, kRg32ui, kRg32f, kRgba32ui, kRgba32i, kRgba32f };

struct ShaderBinding {
  enum class Kind { kStorageBuffer, kTexelBuffer };
  Kind kind = Kind::kStorageBuffer;
  TexelFormat format = TexelFormat::kR32ui;  // of a texel buffer
  std::string name;
};

// What a compute shader says about itself.
struct ShaderInterface {
  std::vector<ShaderBinding> bindings;  // set 0, binding 0..n-1
  std::size_t push_constant_bytes = 0;
  std::array<std::uint32_t, 3> workgroup_size{};  // after specialization
  std::vector<std::uint32_t> capabilities;        // SpvCapability
};

// Reads it from the SPIR-V. `specialization[i]` is the value of constant_id i. Throws Error that
// names the kernel when the SPIR-V cannot be read, is no compute shader, has resources of another
// kind or set, gaps in its bindings, or lacks a constant of `specialization`.
ShaderInterface ReadShaderInterface(const std::string& kernel, std::span<const std::uint32_t> spirv,
                                    std::span<const std::uint32_t> specialization);

}  // namespace mono3d
