// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/device_internals.h"
#include "gpu/host_kernel.h"
#include "gpu/shader_interface.h"

namespace mono3d {

// What a Kernel owns. Members in the order in which they need each other.
struct KernelPipeline {
  std::shared_ptr<Device> device;
  std::string name;
  ShaderInterface interface;
  HostKernel host = nullptr;  // what runs in place of the pipeline, which is then not made
  std::vector<std::uint32_t> specialization;
  std::uint32_t num_storage_buffers = 0;
  std::uint32_t num_texel_buffers = 0;
  vk::raii::DescriptorSetLayout set_layout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
};

struct TexelFormatInfo {
  vk::Format format;
  std::size_t texel_bytes;
};
TexelFormatInfo InfoOf(TexelFormat format);

}  // namespace mono3d
