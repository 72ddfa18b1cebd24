// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "gpu/kernel.h"

namespace mono3d {

// One shader in as many variants as its specialisation constants take values: what does not change
// from pixel to pixel costs nothing. Each variant is made when it is first asked for. One thread at
// a time.
class KernelVariants {
 public:
  KernelVariants(std::shared_ptr<Device> device, const KernelSource& source);

  // `constants[i]` is the value of constant_id i. The reference stays valid.
  const Kernel& With(const std::vector<std::uint32_t>& constants = {});

 private:
  std::shared_ptr<Device> device_;
  KernelSource source_;
  std::map<std::vector<std::uint32_t>, Kernel> kernels_;
};

}  // namespace mono3d
