// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/shader_interface.h"

#include <spirv_cross_c.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// One shader open in SPIRV-Cross, whose C interface is the one with a stable ABI.
class Reflection {
 public:
  Reflection(const std::string& kernel, std::span<const std::uint32_t> spirv) : kernel_(kernel) {
    spvc_context context = nullptr;
    if (spvc_context_create(&context) != SPVC_SUCCESS) Fail("SPIRV-Cross does not start");
    context_.reset(context);
    spvc_parsed_ir ir = nullptr;
    Check(spvc_context_parse_spirv(context, spirv.data(), spirv.size(), &ir));
    Check(spvc_context_create_compiler(context, SPVC_BACKEND_NONE, ir,
                                       SPVC_CAPTURE_MODE_TAKE_OWNERSHIP, &compiler_));
    if (spvc_compiler_get_execution_model(compiler_) != SpvExecutionModelGLCompute) {
      Fail("it is no compute shader");
    }
    Check(spvc_compiler_create_shader_resources(compiler_, &resources_));
  }

  spvc_compiler compiler() const { return compiler_; }

  std::span<const spvc_reflected_resource> List(spvc_resource_type type) const {
    const spvc_reflected_resource* list = nullptr;
    std::size_t size = 0;
    Check(spvc_resources_get_resource_list_for_type(resources_, type, &list, &size));
    return {list, size};
  }

  void Check(spvc_result result) const {
    if (result != SPVC_SUCCESS) Fail(spvc_context_get_last_error_string(context_.get()));
  }

  [[noreturn]] void Fail(const std::string& why) const {
    throw Error(
        {"the shader cannot be used: " + why, kernel_, {}, {}, ErrorCode::kInvalidArgument});
  }

 private:
  struct Destroy {
    void operator()(spvc_context context) const { spvc_context_destroy(context); }
  };

  const std::string& kernel_;
  std::unique_ptr<spvc_context_s, Destroy> context_;
  spvc_compiler compiler_ = nullptr;
  spvc_resources resources_ = nullptr;
};

std::optional<TexelFormat> ToTexelFormat(SpvImageFormat format) {
  switch (format) {
    case SpvImageFormatR32ui:
      return TexelFormat::kR32ui;
    case SpvImageFormatR32i:
      return TexelFormat::kR32i;
    case SpvImageFormatR32f:
      return TexelFormat::kR32f;
    case SpvImageFormatRg32ui:
      return TexelFormat::kRg32ui;
    case SpvImageFormatRg32f:
      return TexelFormat::kRg32f;
    case SpvImageFormatRgba32ui:
      return TexelFormat::kRgba32ui;
    case SpvImageFormatRgba32i:
      return TexelFormat::kRgba32i;
    case SpvImageFormatRgba32f:
      return TexelFormat::kRgba32f;
    default:
      return std::nullopt;
  }
}

TexelFormat ReadTexelFormat(const Reflection& shader, spvc_type type, const std::string& name) {
  const auto format = ToTexelFormat(spvc_type_get_image_storage_format(type));
  if (spvc_type_get_image_dimension(type) != SpvDimBuffer || !format) {
    shader.Fail(name + " is no imageBuffer of format r32*, rg32* or rgba32*");
  }
  return *format;
}

void AddBindings(const Reflection& shader, spvc_resource_type resource_type,
                 std::map<std::uint32_t, ShaderBinding>& by_number) {
  for (const spvc_reflected_resource& resource : shader.List(resource_type)) {
    const auto decoration = [&](SpvDecoration which) {
      return spvc_compiler_get_decoration(shader.compiler(), resource.id, which);
    };
    const spvc_type type = spvc_compiler_get_type_handle(shader.compiler(), resource.type_id);
    ShaderBinding binding;
    binding.name = resource.name;
    if (decoration(SpvDecorationDescriptorSet) != 0) shader.Fail(binding.name + " is not in set 0");
    if (spvc_type_get_num_array_dimensions(type) != 0) {
      shader.Fail(binding.name + " is an array of bindings");
    }
    if (resource_type == SPVC_RESOURCE_TYPE_STORAGE_IMAGE) {
      binding.kind = ShaderBinding::Kind::kTexelBuffer;
      binding.format = ReadTexelFormat(shader, type, binding.name);
    }
    const std::string name = binding.name;
    if (!by_number.emplace(decoration(SpvDecorationBinding), std::move(binding)).second) {
      shader.Fail(name + " shares its binding");
    }
  }
}

std::vector<ShaderBinding> ReadBindings(const Reflection& shader) {
  std::map<std::uint32_t, ShaderBinding> by_number;
  AddBindings(shader, SPVC_RESOURCE_TYPE_STORAGE_BUFFER, by_number);
  AddBindings(shader, SPVC_RESOURCE_TYPE_STORAGE_IMAGE, by_number);
  std::vector<ShaderBinding> bindings;
  for (auto& [number, binding] : by_number) {
    if (number != bindings.size()) {
      shader.Fail("binding " + std::to_string(bindings.size()) + " is missing");
    }
    bindings.push_back(std::move(binding));
  }
  return bindings;
}

void RefuseOtherResources(const Reflection& shader) {
  for (const spvc_resource_type type :
       {SPVC_RESOURCE_TYPE_UNIFORM_BUFFER, SPVC_RESOURCE_TYPE_SAMPLED_IMAGE,
        SPVC_RESOURCE_TYPE_SEPARATE_IMAGE, SPVC_RESOURCE_TYPE_SEPARATE_SAMPLERS,
        SPVC_RESOURCE_TYPE_ACCELERATION_STRUCTURE, SPVC_RESOURCE_TYPE_ATOMIC_COUNTER}) {
    const auto list = shader.List(type);
    if (!list.empty()) {
      shader.Fail(std::string(list.front().name) + " is neither a buffer nor an imageBuffer");
    }
  }
}

std::size_t ReadPushConstantBytes(const Reflection& shader) {
  const auto list = shader.List(SPVC_RESOURCE_TYPE_PUSH_CONSTANT);
  if (list.empty()) return 0;
  const spvc_type type =
      spvc_compiler_get_type_handle(shader.compiler(), list.front().base_type_id);
  std::size_t size = 0;
  shader.Check(spvc_compiler_get_declared_struct_size(shader.compiler(), type, &size));
  return size;
}

std::span<const spvc_specialization_constant> SpecializationConstants(const Reflection& shader) {
  const spvc_specialization_constant* list = nullptr;
  std::size_t size = 0;
  shader.Check(spvc_compiler_get_specialization_constants(shader.compiler(), &list, &size));
  return {list, size};
}

void CheckSpecialization(const Reflection& shader, std::size_t num_values) {
  const auto constants = SpecializationConstants(shader);
  for (std::size_t i = 0; i < num_values; ++i) {
    const bool known = std::any_of(constants.begin(), constants.end(),
                                   [&](const auto& c) { return c.constant_id == i; });
    if (!known) shader.Fail("it has no specialization constant " + std::to_string(i));
  }
}

std::array<std::uint32_t, 3> ReadWorkgroupSize(const Reflection& shader,
                                               std::span<const std::uint32_t> specialization) {
  std::array<spvc_specialization_constant, 3> constants{};
  spvc_compiler_get_work_group_size_specialization_constants(shader.compiler(), &constants[0],
                                                             &constants[1], &constants[2]);
  std::array<std::uint32_t, 3> size{};
  for (unsigned i = 0; i < 3; ++i) {
    const spvc_specialization_constant& constant = constants[i];
    if (constant.id == 0) {  // a plain number
      size[i] = spvc_compiler_get_execution_mode_argument_by_index(shader.compiler(),
                                                                   SpvExecutionModeLocalSize, i);
    } else if (constant.constant_id < specialization.size()) {
      size[i] = specialization[constant.constant_id];
    } else {
      size[i] = spvc_constant_get_scalar_u32(
          spvc_compiler_get_constant_handle(shader.compiler(), constant.id), 0, 0);
    }
  }
  return size;
}

}  // namespace

ShaderInterface ReadShaderInterface(const std::string& kernel, std::span<const std::uint32_t> spirv,
                                    std::span<const std::uint32_t> specialization) {
  const Reflection shader(kernel, spirv);
  RefuseOtherResources(shader);
  CheckSpecialization(shader, specialization.size());
  ShaderInterface result;
  result.bindings = ReadBindings(shader);
  result.push_constant_bytes = ReadPushConstantBytes(shader);
  result.workgroup_size = ReadWorkgroupSize(shader, specialization);
  const SpvCapability* capabilities = nullptr;
  std::size_t size = 0;
  shader.Check(spvc_compiler_get_declared_capabilities(shader.compiler(), &capabilities, &size));
  for (std::size_t i = 0; i < size; ++i) {
    result.capabilities.push_back(static_cast<std::uint32_t>(capabilities[i]));
  }
  return result;
}

}  // namespace mono3d
