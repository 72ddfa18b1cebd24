// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/source_kernels.h"

#include <utility>

namespace mono3d {

SourceKernels::SourceKernels(std::shared_ptr<Device> device, const KernelSource& source,
                             std::vector<std::uint32_t> constants)
    : device_(std::move(device)), source_(source), constants_(std::move(constants)) {
  For(kBundleSize - 1);
}

const Kernel& SourceKernels::For(std::size_t num_sources) {
  const std::size_t sources_per_side = num_sources / 2;
  std::optional<Kernel>& kernel = kernels_.at(sources_per_side - 1);
  if (!kernel) {
    std::vector<std::uint32_t> constants = {static_cast<std::uint32_t>(sources_per_side)};
    constants.insert(constants.end(), constants_.begin(), constants_.end());
    kernel.emplace(device_, source_, constants);
  }
  return *kernel;
}

}  // namespace mono3d
