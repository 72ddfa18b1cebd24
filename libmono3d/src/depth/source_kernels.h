// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "depth/sweep_geometry.h"
#include "gpu/kernel.h"

namespace mono3d {

// A kernel for each number of sources, which is its specialisation constant 0 (per side of the
// reference): what does not change from pixel to pixel costs nothing. `constants` are the further
// ones. That of the default bundle is made at once, the others when they are first asked for.
class SourceKernels {
 public:
  SourceKernels(std::shared_ptr<Device> device, const KernelSource& source,
                std::vector<std::uint32_t> constants = {});

  // `num_sources` is even, 2 to kMaxSources. The reference stays valid.
  const Kernel& For(std::size_t num_sources);

 private:
  std::shared_ptr<Device> device_;
  KernelSource source_;
  std::vector<std::uint32_t> constants_;
  std::array<std::optional<Kernel>, kMaxSources / 2> kernels_;  // by sources per side - 1
};

}  // namespace mono3d
