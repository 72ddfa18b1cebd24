// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/surfel.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"

namespace mono3d {

// Blocks of slots that hold so many surfels, one at least; no more than can be counted.
std::uint32_t SlotsFor(std::uint64_t num_surfels);
inline std::uint32_t NumBlocks(std::uint32_t num_surfels) {
  return WholeBlocks(num_surfels) / kSurfelsPerBlock;
}

// Slots for surfels on the device, in blocks of one anchor each: one buffer per field of Surfels
// and per figure of a block, which grow in steps. Knows which blocks are free, and not what the
// others hold.
class SurfelSlots {
 public:
  // Never has more than `max_slots`, nor more than a buffer holds; of these `limit` until SetLimit.
  SurfelSlots(std::shared_ptr<Device> device, std::uint32_t max_slots, std::uint32_t limit);

  // The slots that may be in use are those before this one.
  std::uint32_t size() const { return size_; }
  std::uint32_t num_blocks() const { return NumBlocks(size_); }
  std::uint32_t num_free() const;
  std::uint32_t limit() const { return limit_; }
  // What the limit may be at most.
  std::uint32_t max_limit() const { return max_limit_; }
  // What is in use, and so many more.
  std::uint64_t NeededFor(std::uint32_t num_slots) const;
  // Has room for so many slots more, if need be by growing; false where that is beyond the limit,
  // or more than the device has, which is the limit from then on.
  bool Grow(std::uint32_t num_slots);
  // Has room for slots up to `size`, as far as it may.
  void Reserve(std::uint32_t size);
  // Another limit, of so many slots, as far as may be.
  void SetLimit(std::uint64_t num_slots);

  // Free blocks, in order, for which there must be room; they are the anchor's from now on.
  std::vector<std::uint32_t> Take(std::uint32_t anchor, std::uint32_t num_blocks);
  void Free(std::span<const std::uint32_t> blocks);
  void FreeAll();
  // The last block has fewer slots than others.
  void ShortenLast(std::uint32_t num_slots) { size_ -= num_slots; }

  void Upload(std::span<const std::uint32_t> blocks, const Surfels& surfels);
  void UploadBounds(std::span<const std::uint32_t> blocks, std::span<const Surfels::Float4> bounds);
  // The first slots of these blocks, so many.
  Surfels Download(std::span<const std::uint32_t> blocks, std::uint32_t num_slots) const;
  Surfels DownloadSlots(std::uint32_t first, std::uint32_t end) const;
  std::vector<Surfels::Float4> DownloadBounds(std::span<const std::uint32_t> blocks) const;

  const Buffer& position_radius() const { return position_radius_; }
  const Buffer& normal_weight() const { return normal_weight_; }
  const Buffer& history() const { return history_; }
  const Buffer& association() const { return association_; }  // uint per slot, for the stages
  // float4 per block of kSurfelsPerBlock: centre and radius of what surrounds its surfels, in the
  // frame of its anchor.
  const Buffer& bounds() const { return bounds_; }
  const Buffer& num_there() const { return num_there_; }  // uint per block: surfels not removed
  const Buffer& anchor_of_block() const { return anchor_of_block_; }  // uint per block
  // uint per block: surfels that the latest depth map has confirmed.
  const Buffer& num_confirmed() const { return num_confirmed_; }
  // As anchor_of_block; undefined where a block is not in use.
  const std::vector<std::uint32_t>& anchors() const { return anchor_of_; }

 private:
  void Allocate(std::uint32_t capacity);

  std::shared_ptr<Device> device_;
  Recorder recorder_;
  std::uint32_t max_limit_;
  std::uint32_t limit_;
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::vector<std::uint32_t> free_;  // blocks before size_, in order
  std::vector<std::uint32_t> anchor_of_;
  Buffer position_radius_;
  Buffer normal_weight_;
  Buffer history_;
  Buffer association_;
  Buffer bounds_;
  Buffer num_there_;
  Buffer anchor_of_block_;
  Buffer num_confirmed_;
};

}  // namespace mono3d
