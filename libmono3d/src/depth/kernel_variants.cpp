// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/kernel_variants.h"

#include <utility>

namespace mono3d {

KernelVariants::KernelVariants(std::shared_ptr<Device> device, const KernelSource& source)
    : device_(std::move(device)), source_(source) {}

const Kernel& KernelVariants::With(const std::vector<std::uint32_t>& constants) {
  const auto found = kernels_.find(constants);
  if (found != kernels_.end()) return found->second;
  return kernels_.emplace(constants, Kernel(device_, source_, constants)).first->second;
}

}  // namespace mono3d
