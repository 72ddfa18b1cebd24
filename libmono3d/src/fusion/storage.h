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

// Without those that are removed, in their order, such that each anchor has blocks of its own: the
// last one of each is filled up with slots that count as removed.
Surfels InWholeBlocks(const Surfels& surfels);

// The surfels of the model on the device, one buffer per field of Surfels, growing in steps.
// Slots 0 to size() - 1 are in use, in the order of their anchors, in blocks of one anchor each;
// removed surfels keep theirs until Compact().
class SurfelStorage {
 public:
  // Never holds more than `max_surfels`, nor more than one buffer of the device does; one block at
  // least.
  SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels);

  std::uint32_t size() const { return size_; }
  std::uint32_t max_size() const { return max_size_; }
  // Without those that are removed.
  std::uint32_t num_surfels() const { return size_ - num_removed_ - num_unused_; }
  // Surfels that were removed since the blocks were closed up.
  std::uint32_t num_removed() const { return num_removed_; }

  const Buffer& position_radius() const { return position_radius_; }
  const Buffer& normal_weight() const { return normal_weight_; }
  const Buffer& history() const { return history_; }
  const Buffer& association() const { return association_; }  // uint per slot, for the stages
  // float4 per block of kSurfelsPerBlock: centre and radius of what surrounds its surfels, in the
  // frame of its anchor.
  const Buffer& bounds() const { return bounds_; }
  const Buffer& anchor_of_block() const { return anchor_of_block_; }  // uint per block
  // uint per block: surfels that the latest depth map has confirmed.
  const Buffer& num_confirmed() const { return num_confirmed_; }
  // What the latest depth map has confirmed of an anchor.
  struct Confirmed {
    std::uint32_t anchor = 0;
    double share = 0;  // of its surfels, 0 to 1
    std::int64_t num_surfels = 0;
    // Of what is known of its surfels, the share that its own depth map has seen: the mean of one
    // over the number of depth maps, per block.
    double own_share = 1;
  };
  // Downloads num_confirmed; once per depth map. Of the anchors of these blocks.
  std::vector<Confirmed> TakeConfirmed(std::span<const std::uint32_t> blocks);
  const std::vector<std::uint32_t>& anchors() const { return anchors_; }  // the same on the host
  // The first slot of this anchor or a later one.
  std::uint32_t FirstSlotOf(std::uint32_t anchor) const;
  // Surfels whose blocks have bounds: none once surfels were replaced.
  std::uint32_t num_bounded() const { return num_bounded_; }
  void SetBounded(std::uint32_t num_surfels) { num_bounded_ = num_surfels; }

  // Makes room for slots up to `size`, at most max_size(). What is there stays.
  void Reserve(Recorder& recorder, std::uint32_t size);
  // From now on max_size() is what there is room for.
  void StopGrowing() { max_size_ = capacity_; }
  // The stages are about to fill so many slots behind the others, for which there is room, with
  // surfels of this anchor.
  void BeginInsert(std::uint32_t anchor, std::uint32_t num_inserted);
  // They have done it, and filled up the last block; and have emptied `num_removed` slots.
  void EndInsert(std::uint32_t anchor, std::uint32_t num_inserted, std::uint32_t num_removed);
  void Remove(std::uint32_t num_removed) { num_removed_ += num_removed; }
  // Closes the gaps that removed surfels left, keeping the order.
  void Compact();

  // Adds surfels behind the others, in whole blocks, for which there is room, with their anchors
  // numbered from `first_anchor` on: behind those of the others.
  void Append(const Surfels& more, std::uint32_t first_anchor);

  // Removes the surfels anchored to this depth map or a later one, and closes the gaps.
  void RemoveAnchoredFrom(std::uint32_t first_anchor);

  Surfels Download() const { return Download(0, size_); }
  Surfels Download(std::uint32_t first, std::uint32_t end) const;
  // Replaces all; within the reserved room, each block of one anchor.
  void Upload(const Surfels& surfels);
  // How often that was: slots may have moved.
  std::uint64_t num_uploads() const { return num_uploads_; }

  // All but the surfels themselves, for a saved state.
  struct Layout {
    std::uint32_t max_size = 0;
    std::uint32_t size = 0;
    std::uint32_t num_removed = 0;
    std::uint32_t num_unused = 0;
    std::uint32_t num_bounded = 0;
    std::vector<std::uint32_t> anchors;   // per block
    std::vector<float> observations;      // per block
    std::vector<Surfels::Float4> bounds;  // per block of those that have them
  };
  Layout GetLayout() const;
  // Takes it over, with undefined surfels, which UploadSlots brings. False, with nothing done,
  // where it contradicts itself or there is no room on the device.
  bool Restore(Recorder& recorder, const Layout& layout);
  void UploadSlots(std::uint32_t first, const Surfels& surfels);

 private:
  void Allocate(std::uint32_t capacity);

  std::shared_ptr<Device> device_;
  std::uint32_t max_size_;
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t num_removed_ = 0;
  std::uint32_t num_unused_ = 0;  // slots that fill up blocks
  std::uint32_t num_bounded_ = 0;
  std::uint64_t num_uploads_ = 0;
  std::vector<std::uint32_t> anchors_;  // per block
  std::vector<float> observations_;     // per block: depth maps that have seen a surfel of it, mean
  Buffer position_radius_;
  Buffer normal_weight_;
  Buffer history_;
  Buffer association_;
  Buffer bounds_;
  Buffer anchor_of_block_;
  Buffer num_confirmed_;
};

}  // namespace mono3d
