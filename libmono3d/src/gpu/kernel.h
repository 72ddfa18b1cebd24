// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/host_kernel.h"
#include "mono3d/gpu/device.h"

namespace mono3d {

// An embedded compute shader: {"depth/census", depth_census_spirv}, and the same as compiled code
// where there is such.
struct KernelSource {
  std::string name;
  std::span<const std::uint32_t> spirv;
  HostKernel host = nullptr;
};

struct KernelPipeline;  // the Vulkan side, gpu/kernel_pipeline.h

// One compute pipeline. Its interface (bindings, push constants, workgroup size) is read from the
// SPIR-V, so nothing about it is written twice. Can be shared by recorders.
class Kernel {
 public:
  // `specialization[i]` is the value of the shader's 32-bit constant_id i; the rest keep their
  // defaults. Throws Error that names the kernel when the shader is not one this library can run
  // (anything but set 0, bindings 0..n-1 of storage or storage-texel buffers, one push-constant
  // block), gives a constant the shader does not have, or needs what the device lacks.
  Kernel(std::shared_ptr<Device> device, const KernelSource& source,
         std::vector<std::uint32_t> specialization = {});

  const std::string& name() const;
  const std::array<std::uint32_t, 3>& workgroup_size() const;  // after specialization
  int num_bindings() const;
  std::size_t push_constant_bytes() const;

 private:
  friend class Recorder;

  std::shared_ptr<const KernelPipeline> pipeline_;
};

}  // namespace mono3d
