// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/descriptor_pools.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gpu/buffer_memory.h"

namespace mono3d {
namespace {

// A depth map is some dozens of dispatches of some four buffers each.
constexpr std::uint32_t kSetsPerPool = 64;
constexpr std::uint32_t kBuffersPerSet = 4;

}  // namespace

vk::DescriptorSet DescriptorPools::Allocate(const KernelPipeline& kernel) {
  const auto fits = [&](const Pool& pool) {
    return pool.sets_left > 0 && pool.storage_left >= kernel.num_storage_buffers &&
           pool.texel_left >= kernel.num_texel_buffers;
  };
  while (current_ < pools_.size() && !fits(pools_[current_])) ++current_;
  const vk::raii::Device& device = kernel.device->vulkan();
  if (current_ == pools_.size()) {
    constexpr std::uint32_t kUsual = kSetsPerPool * kBuffersPerSet;
    const std::uint32_t num_storage = std::max(kUsual, kernel.num_storage_buffers);
    const std::uint32_t num_texel = std::max(kUsual, kernel.num_texel_buffers);
    const std::array sizes = {
        vk::DescriptorPoolSize(vk::DescriptorType::eStorageBuffer, num_storage),
        vk::DescriptorPoolSize(vk::DescriptorType::eStorageTexelBuffer, num_texel)};
    pools_.push_back({device.createDescriptorPool({{}, kSetsPerPool, sizes}), num_storage,
                      num_texel, kSetsPerPool, num_storage, num_texel});
  }
  Pool& pool = pools_[current_];
  const vk::DescriptorSetLayout layout = *kernel.set_layout;
  // Not the raii call: its sets would be freed one by one, ours go back with the whole pool.
  const vk::DescriptorSet set =
      (*device).allocateDescriptorSets({*pool.pool, layout}, *device.getDispatcher()).front();
  pool.sets_left -= 1;
  pool.storage_left -= kernel.num_storage_buffers;
  pool.texel_left -= kernel.num_texel_buffers;
  return set;
}

vk::DescriptorSet DescriptorPools::Make(const KernelPipeline& kernel,
                                        const std::vector<BufferMemory*>& buffers) {
  const vk::DescriptorSet set = Allocate(kernel);
  std::vector<vk::DescriptorBufferInfo> ranges(buffers.size());
  std::vector<vk::BufferView> views(buffers.size());
  std::vector<vk::WriteDescriptorSet> writes(buffers.size());
  for (std::uint32_t i = 0; i < buffers.size(); ++i) {
    const ShaderBinding& binding = kernel.interface.bindings[i];
    vk::WriteDescriptorSet& write = writes[i];
    write.setDstSet(set).setDstBinding(i);
    if (binding.kind == ShaderBinding::Kind::kTexelBuffer) {
      const TexelFormatInfo texel = InfoOf(binding.format);
      views[i] = TexelView(*buffers[i], texel.format, texel.texel_bytes);
      write.setDescriptorType(vk::DescriptorType::eStorageTexelBuffer);
      write.setTexelBufferView(views[i]);
    } else {
      ranges[i] = vk::DescriptorBufferInfo(*buffers[i]->buffer, 0, buffers[i]->allocated_bytes);
      write.setDescriptorType(vk::DescriptorType::eStorageBuffer).setBufferInfo(ranges[i]);
    }
  }
  kernel.device->vulkan().updateDescriptorSets(writes, {});
  return set;
}

void DescriptorPools::Reset() {
  for (Pool& pool : pools_) {
    pool.pool.reset();
    pool.sets_left = kSetsPerPool;
    pool.storage_left = pool.num_storage;
    pool.texel_left = pool.num_texel;
  }
  current_ = 0;
}

}  // namespace mono3d
