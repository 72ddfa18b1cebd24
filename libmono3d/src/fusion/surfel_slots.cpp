// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_slots.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <string>
#include <utility>

#include "gpu/device_handle.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Capacities are multiples of this: buffers of whole MiB.
constexpr std::uint32_t kCapacityStep = 65'536;

std::uint64_t SurfelsOfBuffer(const Device& device) {
  const DeviceLimits& limits = Limits(device);
  return std::min<std::uint64_t>(limits.max_storage_buffer_bytes / sizeof(Surfels::Float4),
                                 limits.max_texel_buffer_elements);
}

std::size_t BytesOfBlocks(std::uint32_t num_surfels, std::size_t bytes_per_block) {
  return std::size_t{NumBlocks(num_surfels)} * bytes_per_block;
}

// Calls with (first block, number of blocks, place in the list) for blocks that follow each other.
template <typename Function>
void ForEachRun(std::span<const std::uint32_t> blocks, const Function& call) {
  for (std::size_t first = 0; first < blocks.size();) {
    std::size_t end = first + 1;
    while (end < blocks.size() && blocks[end] == blocks[end - 1] + 1) ++end;
    call(blocks[first], end - first, first);
    first = end;
  }
}

template <typename T>
std::span<T> Part(std::vector<T>& values, std::size_t first, std::size_t count) {
  return std::span<T>(values).subspan(first, std::min(count, values.size() - first));
}
template <typename T>
std::span<const T> Part(const std::vector<T>& values, std::size_t first, std::size_t count) {
  return std::span<const T>(values).subspan(first, std::min(count, values.size() - first));
}

}  // namespace

std::uint32_t SlotsFor(std::uint64_t num_surfels) {
  constexpr std::uint64_t kMost = 0xFFFFFFFFU / kSurfelsPerBlock;
  const std::uint64_t num_blocks = std::min(num_surfels / kSurfelsPerBlock, kMost);
  return static_cast<std::uint32_t>(std::max<std::uint64_t>(num_blocks, 1)) * kSurfelsPerBlock;
}

SurfelSlots::SurfelSlots(std::shared_ptr<Device> device, std::uint32_t max_slots,
                         std::uint32_t limit)
    : device_(std::move(device)),
      recorder_(device_),
      max_limit_(SlotsFor(std::min<std::uint64_t>(max_slots, SurfelsOfBuffer(*device_)))),
      limit_(std::min(limit, max_limit_)) {
  Allocate(std::min(kCapacityStep, limit_));
}

void SurfelSlots::Allocate(std::uint32_t capacity) {
  const std::size_t bytes = std::size_t{capacity} * sizeof(Surfels::Float4);
  Buffer position_radius(device_, bytes, "fusion/position_radius");
  Buffer normal_weight(device_, bytes, "fusion/normal_weight");
  Buffer history(device_, bytes, "fusion/history");
  Buffer association(device_, std::size_t{capacity} * 4, "fusion/association");
  const auto per_block = [&](std::size_t block_bytes, const char* name) {
    return Buffer(device_, BytesOfBlocks(capacity, block_bytes), name);
  };
  Buffer bounds = per_block(sizeof(Surfels::Float4), "fusion/block_bounds");
  Buffer num_there = per_block(sizeof(std::uint32_t), "fusion/num_there");
  Buffer anchor_of_block = per_block(sizeof(std::uint32_t), "fusion/anchor_of_block");
  Buffer num_confirmed = per_block(sizeof(std::uint32_t), "fusion/num_confirmed");
  if (size_ > 0) {
    const auto copy = [&](const Buffer& from, const Buffer& to, std::size_t element_bytes) {
      recorder_.Copy(from, 0, to, 0, element_bytes * size_);
    };
    copy(position_radius_, position_radius, sizeof(Surfels::Float4));
    copy(normal_weight_, normal_weight, sizeof(Surfels::Float4));
    copy(history_, history, sizeof(Surfels::Uint4));
    copy(association_, association, sizeof(std::uint32_t));
    const auto copy_blocks = [&](const Buffer& from, const Buffer& to, std::size_t block_bytes) {
      recorder_.Copy(from, 0, to, 0, BytesOfBlocks(size_, block_bytes));
    };
    copy_blocks(bounds_, bounds, sizeof(Surfels::Float4));
    copy_blocks(num_there_, num_there, sizeof(std::uint32_t));
    copy_blocks(anchor_of_block_, anchor_of_block, sizeof(std::uint32_t));
    copy_blocks(num_confirmed_, num_confirmed, sizeof(std::uint32_t));
    recorder_.Submit();
  }
  position_radius_ = std::move(position_radius);
  normal_weight_ = std::move(normal_weight);
  history_ = std::move(history);
  association_ = std::move(association);
  bounds_ = std::move(bounds);
  num_there_ = std::move(num_there);
  anchor_of_block_ = std::move(anchor_of_block);
  num_confirmed_ = std::move(num_confirmed);
  capacity_ = capacity;
  anchor_of_.resize(NumBlocks(capacity));
}

std::uint32_t SurfelSlots::num_free() const {
  return static_cast<std::uint32_t>(free_.size()) * kSurfelsPerBlock + capacity_ -
         WholeBlocks(size_);
}

std::uint64_t SurfelSlots::NeededFor(std::uint32_t num_slots) const {
  return std::uint64_t{capacity_} - num_free() + num_slots;
}

bool SurfelSlots::Grow(std::uint32_t num_slots) {
  const std::uint64_t needed = NeededFor(num_slots);
  if (needed <= capacity_) return true;
  if (needed > limit_) return false;
  // By half at least, so that a growing model is copied a bounded number of times.
  const std::uint64_t wanted = std::max<std::uint64_t>(needed, std::uint64_t{capacity_} * 3 / 2);
  const std::uint64_t rounded = (wanted + kCapacityStep - 1) / kCapacityStep * kCapacityStep;
  try {
    Allocate(static_cast<std::uint32_t>(std::min<std::uint64_t>(rounded, limit_)));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kOutOfMemory) throw;
    Log(LogLevel::kWarning,
        std::string("no more of the model than now can be on the device: ") + error.what());
    limit_ = max_limit_ = capacity_;
    return false;
  }
  return true;
}

void SurfelSlots::Reserve(std::uint32_t size) {
  if (size > capacity_) (void)Grow(size - (capacity_ - num_free()));
}

void SurfelSlots::SetLimit(std::uint64_t num_slots) {
  limit_ = SlotsFor(std::min<std::uint64_t>(num_slots, max_limit_));
}

std::vector<std::uint32_t> SurfelSlots::Take(std::uint32_t anchor, std::uint32_t num_blocks) {
  assert(std::uint64_t{num_blocks} * kSurfelsPerBlock <= num_free());
  const std::size_t num_reused = std::min<std::size_t>(num_blocks, free_.size());
  std::vector<std::uint32_t> blocks(free_.begin(),
                                    free_.begin() + static_cast<std::ptrdiff_t>(num_reused));
  free_.erase(free_.begin(), free_.begin() + static_cast<std::ptrdiff_t>(num_reused));
  if (num_reused < num_blocks) {
    const std::uint32_t first = NumBlocks(size_);
    blocks.resize(num_blocks);
    std::iota(blocks.begin() + static_cast<std::ptrdiff_t>(num_reused), blocks.end(), first);
    size_ = (blocks.back() + 1) * kSurfelsPerBlock;
  }
  for (const std::uint32_t block : blocks) anchor_of_[block] = anchor;
  const std::vector<std::uint32_t> added(blocks.size(), anchor);
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    anchor_of_block_.Upload(Part(added, at, count), first * sizeof(std::uint32_t));
  });
  return blocks;
}

void SurfelSlots::Free(std::span<const std::uint32_t> blocks) {
  if (blocks.empty()) return;
  // Stages that run over all blocks must find an anchor that there is.
  const std::vector<std::uint32_t> none(blocks.size(), 0);
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    anchor_of_block_.Upload(Part(none, at, count), first * sizeof(std::uint32_t));
  });
  const auto middle = static_cast<std::ptrdiff_t>(free_.size());
  free_.insert(free_.end(), blocks.begin(), blocks.end());
  std::sort(free_.begin() + middle, free_.end());
  std::inplace_merge(free_.begin(), free_.begin() + middle, free_.end());
}

void SurfelSlots::FreeAll() {
  size_ = 0;
  free_.clear();
}

void SurfelSlots::Upload(std::span<const std::uint32_t> blocks, const Surfels& surfels) {
  ForEachRun(blocks, [&](std::uint32_t block, std::size_t count, std::size_t at) {
    const std::size_t first = at * kSurfelsPerBlock;
    const std::size_t num = count * kSurfelsPerBlock;
    const std::size_t offset_bytes =
        std::size_t{block} * kSurfelsPerBlock * sizeof(Surfels::Float4);
    position_radius_.Upload(Part(surfels.position_radius, first, num), offset_bytes);
    normal_weight_.Upload(Part(surfels.normal_weight, first, num), offset_bytes);
    history_.Upload(Part(surfels.history, first, num), offset_bytes);
  });
}

void SurfelSlots::UploadBounds(std::span<const std::uint32_t> blocks,
                               std::span<const Surfels::Float4> bounds) {
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    bounds_.Upload(bounds.subspan(at, count), first * sizeof(Surfels::Float4));
  });
}

Surfels SurfelSlots::Download(std::span<const std::uint32_t> blocks,
                              std::uint32_t num_slots) const {
  Surfels surfels;
  surfels.resize(num_slots);
  ForEachRun(blocks, [&](std::uint32_t block, std::size_t count, std::size_t at) {
    const std::size_t first = at * kSurfelsPerBlock;
    const std::size_t num = count * kSurfelsPerBlock;
    const std::size_t offset_bytes =
        std::size_t{block} * kSurfelsPerBlock * sizeof(Surfels::Float4);
    position_radius_.Download(Part(surfels.position_radius, first, num), offset_bytes);
    normal_weight_.Download(Part(surfels.normal_weight, first, num), offset_bytes);
    history_.Download(Part(surfels.history, first, num), offset_bytes);
  });
  return surfels;
}

Surfels SurfelSlots::DownloadSlots(std::uint32_t first, std::uint32_t end) const {
  Surfels surfels;
  surfels.resize(end - first);
  const std::size_t offset_bytes = std::size_t{first} * sizeof(Surfels::Float4);
  position_radius_.Download(std::span(surfels.position_radius), offset_bytes);
  normal_weight_.Download(std::span(surfels.normal_weight), offset_bytes);
  history_.Download(std::span(surfels.history), offset_bytes);
  return surfels;
}

std::vector<Surfels::Float4> SurfelSlots::DownloadBounds(
    std::span<const std::uint32_t> blocks) const {
  std::vector<Surfels::Float4> bounds(blocks.size());
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    bounds_.Download(Part(bounds, at, count), first * sizeof(Surfels::Float4));
  });
  return bounds;
}

}  // namespace mono3d
