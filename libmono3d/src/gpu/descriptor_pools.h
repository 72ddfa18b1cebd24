// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpu/kernel_pipeline.h"

namespace mono3d {

struct BufferMemory;

// Descriptor sets for the dispatches of one submission; all return at Reset. Grows as needed and
// keeps what it has, so that after the first few submissions nothing is allocated.
class DescriptorPools {
 public:
  // One set for the kernel, bound to `buffers` (as many as the kernel has bindings).
  vk::DescriptorSet Make(const KernelPipeline& kernel, const std::vector<BufferMemory*>& buffers);
  void Reset();

 private:
  vk::DescriptorSet Allocate(const KernelPipeline& kernel);

  struct Pool {
    vk::raii::DescriptorPool pool;
    std::uint32_t num_storage, num_texel;               // buffers it holds when empty
    std::uint32_t sets_left, storage_left, texel_left;  // until Reset
  };
  std::vector<Pool> pools_;
  std::size_t current_ = 0;
};

}  // namespace mono3d
