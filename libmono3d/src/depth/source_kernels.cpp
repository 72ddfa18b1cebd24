// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/source_kernels.h"

#include <cstdint>
#include <utility>

namespace mono3d {

SourceKernels::SourceKernels(std::shared_ptr<Device> device, const KernelSource& source)
    : device_(std::move(device)), source_(source) {
  For(kBundleSize - 1);
}

const Kernel& SourceKernels::For(std::size_t num_sources) {
  const std::size_t sources_per_side = num_sources / 2;
  std::optional<Kernel>& kernel = kernels_.at(sources_per_side - 1);
  if (!kernel) {
    kernel.emplace(device_, source_, std::vector{static_cast<std::uint32_t>(sources_per_side)});
  }
  return *kernel;
}

}  // namespace mono3d
