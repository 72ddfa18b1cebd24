// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/kernel.h"

#include <spirv_cross_c.h>

#include <algorithm>
#include <utility>

#include "gpu/address_space.h"
#include "gpu/kernel_pipeline.h"

namespace mono3d {
namespace {

void RequireAtMost(const KernelPipeline& kernel, const std::string& what, std::uint64_t found,
                   std::uint64_t limit) {
  if (found <= limit) return;
  throw Error({kernel.device->info().name + " cannot run this shader: " + what, kernel.name,
               "at most " + std::to_string(limit), std::to_string(found), ErrorCode::kUnsupported});
}

void CheckCapabilities(const KernelPipeline& kernel) {
  for (const std::uint32_t capability : kernel.interface.capabilities) {
    const auto missing = MissingCapability(kernel.device->features(), capability);
    if (missing) {
      throw Error({kernel.device->info().name + " cannot run this shader: it needs " + *missing,
                   kernel.name,
                   {},
                   {},
                   ErrorCode::kUnsupported});
    }
  }
}

void CheckLimits(const KernelPipeline& kernel) {
  const DeviceLimits& limits = kernel.device->limits();
  const auto& size = kernel.interface.workgroup_size;
  std::uint64_t num_invocations = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    if (size[i] == 0)
      throw Error({"the workgroup size is 0", kernel.name, {}, {}, ErrorCode::kInvalidArgument});
    RequireAtMost(kernel, "workgroup size", size[i], limits.max_workgroup_size[i]);
    num_invocations *= size[i];
  }
  RequireAtMost(kernel, "invocations per workgroup", num_invocations,
                limits.max_workgroup_invocations);
  RequireAtMost(kernel, "bytes of push constants", kernel.interface.push_constant_bytes,
                limits.max_push_constant_bytes);
  RequireAtMost(kernel, "storage buffers", kernel.num_storage_buffers, limits.max_storage_buffers);
  RequireAtMost(kernel, "texel buffers", kernel.num_texel_buffers, limits.max_texel_buffers);
}

vk::raii::DescriptorSetLayout MakeSetLayout(KernelPipeline& kernel) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  for (const ShaderBinding& binding : kernel.interface.bindings) {
    const bool is_texel = binding.kind == ShaderBinding::Kind::kTexelBuffer;
    bindings.emplace_back(
        static_cast<std::uint32_t>(bindings.size()),
        is_texel ? vk::DescriptorType::eStorageTexelBuffer : vk::DescriptorType::eStorageBuffer, 1,
        vk::ShaderStageFlagBits::eCompute);
  }
  return kernel.device->vulkan().createDescriptorSetLayout({{}, bindings});
}

vk::raii::PipelineLayout MakeLayout(const KernelPipeline& kernel) {
  const vk::PushConstantRange range(
      vk::ShaderStageFlagBits::eCompute, 0,
      static_cast<std::uint32_t>(kernel.interface.push_constant_bytes));
  const vk::DescriptorSetLayout set_layout = *kernel.set_layout;
  vk::PipelineLayoutCreateInfo info({}, set_layout);
  if (range.size > 0) info.setPushConstantRanges(range);
  return kernel.device->vulkan().createPipelineLayout(info);
}

bool UsesSubgroups(const KernelPipeline& kernel) {
  return std::find(kernel.interface.capabilities.begin(), kernel.interface.capabilities.end(),
                   SpvCapabilityGroupNonUniform) != kernel.interface.capabilities.end();
}

vk::raii::Pipeline MakePipeline(const KernelPipeline& kernel,
                                std::span<const std::uint32_t> spirv) {
  const std::vector<std::uint32_t>& specialization = kernel.specialization;
  const Device& device = *kernel.device;
  const vk::raii::ShaderModule module =
      device.vulkan().createShaderModule({{}, spirv.size_bytes(), spirv.data()});
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < specialization.size(); ++i) entries.emplace_back(i, 4 * i, 4);
  const vk::SpecializationInfo constants(static_cast<std::uint32_t>(entries.size()), entries.data(),
                                         specialization.size() * sizeof(std::uint32_t),
                                         specialization.data());
  vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main",
                                          &constants);
  // Some drivers choose the subgroup size per shader; stages are specialised on the one in the
  // limits.
  const std::uint32_t subgroup_size = device.limits().subgroup_size;
  const vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo required(subgroup_size);
  if (device.features().subgroup_size_control && UsesSubgroups(kernel)) {
    stage.pNext = &required;
    if (device.features().full_subgroups &&
        kernel.interface.workgroup_size[0] % subgroup_size == 0) {
      stage.flags |= vk::PipelineShaderStageCreateFlagBits::eRequireFullSubgroups;
    }
  }
  return device.vulkan().createComputePipeline(device.pipeline_cache(),
                                               {{}, stage, *kernel.layout});
}

}  // namespace

TexelFormatInfo InfoOf(TexelFormat format) {
  switch (format) {
    case TexelFormat::kR32ui:
      return {vk::Format::eR32Uint, 4};
    case TexelFormat::kR32i:
      return {vk::Format::eR32Sint, 4};
    case TexelFormat::kR32f:
      return {vk::Format::eR32Sfloat, 4};
    case TexelFormat::kRg32ui:
      return {vk::Format::eR32G32Uint, 8};
    case TexelFormat::kRg32f:
      return {vk::Format::eR32G32Sfloat, 8};
    case TexelFormat::kRgba32ui:
      return {vk::Format::eR32G32B32A32Uint, 16};
    case TexelFormat::kRgba32i:
      return {vk::Format::eR32G32B32A32Sint, 16};
    case TexelFormat::kRgba32f:
      return {vk::Format::eR32G32B32A32Sfloat, 16};
  }
  throw Error("unknown texel format", ErrorCode::kInvalidArgument);
}

Kernel::Kernel(std::shared_ptr<Device> device, const KernelSource& source,
               std::vector<std::uint32_t> specialization) {
  auto kernel = std::make_shared<KernelPipeline>();
  kernel->device = std::move(device);
  kernel->name = source.name;
  kernel->interface = ReadShaderInterface(source.name, source.spirv, specialization);
  for (const ShaderBinding& binding : kernel->interface.bindings) {
    ++(binding.kind == ShaderBinding::Kind::kTexelBuffer ? kernel->num_texel_buffers
                                                         : kernel->num_storage_buffers);
  }
  CheckCapabilities(*kernel);
  CheckLimits(*kernel);
  kernel->host = kernel->device->host_threads() == nullptr ? nullptr : source.host;
  kernel->specialization = std::move(specialization);
  if (kernel->host != nullptr) {
    pipeline_ = std::move(kernel);
    return;
  }
  RequireAddressSpace(source.name, kDriverCallBytes);
  CallVulkan(source.name, "making the pipeline", [&] {
    kernel->set_layout = MakeSetLayout(*kernel);
    kernel->layout = MakeLayout(*kernel);
    kernel->pipeline = MakePipeline(*kernel, source.spirv);
    kernel->device->SetName(*kernel->pipeline, source.name);
  });
  pipeline_ = std::move(kernel);
}

const std::string& Kernel::name() const { return pipeline_->name; }

const std::array<std::uint32_t, 3>& Kernel::workgroup_size() const {
  return pipeline_->interface.workgroup_size;
}

int Kernel::num_bindings() const { return static_cast<int>(pipeline_->interface.bindings.size()); }

std::size_t Kernel::push_constant_bytes() const { return pipeline_->interface.push_constant_bytes; }

}  // namespace mono3d
