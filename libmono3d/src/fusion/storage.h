// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "fusion/surfel.h"
#include "fusion/surfel_depot.h"
#include "fusion/surfel_slots.h"

namespace mono3d {

// How much of a model is on the device.
struct Residency {
  // Surfels; what one view sees is there, however many that are. No more than a buffer holds.
  std::uint32_t max_surfels = 0xFFFFFFFFU;
  SurfelDepot* depot = nullptr;  // of the others; without one all stay
};

// The surfels of the model, in blocks of one anchor each. Those of the anchors that views of late
// have seen are on the device, in SurfelSlots; the others are in a depot. An anchor is there or not
// as a whole. Which slots it has there, whichever are free, is no part of the model: the order of
// its surfels is that of the anchors, and of the blocks of each. Numbers of slots and blocks are
// those on the device. Removed surfels keep their slots until CloseGaps().
class SurfelStorage {
 public:
  // Never holds more than `max_surfels`; one block at least.
  SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels,
                const Residency& residency = {});

  // The slots on the device that may be in use are those before this one.
  std::uint32_t size() const { return slots_.size(); }
  // Slots that all of the model needs, on the device or not, and that it may have.
  std::uint32_t num_slots() const { return num_slots_; }
  std::uint32_t max_slots() const { return max_slots_; }
  // Without those that are removed.
  std::uint32_t num_surfels() const { return num_surfels_; }
  // One more than the last anchor with surfels.
  std::uint32_t num_anchors() const { return static_cast<std::uint32_t>(of_anchor_.size()); }
  // Slots of an anchor, whether on the device or not.
  std::uint32_t NumSlotsOf(std::uint32_t anchor) const;

  // Of the slots on the device: see SurfelSlots.
  const Buffer& position_radius() const { return slots_.position_radius(); }
  const Buffer& normal_weight() const { return slots_.normal_weight(); }
  const Buffer& history() const { return slots_.history(); }
  const Buffer& association() const { return slots_.association(); }
  const Buffer& bounds() const { return slots_.bounds(); }
  const Buffer& num_there() const { return slots_.num_there(); }
  const Buffer& anchor_of_block() const { return slots_.anchor_of_block(); }
  const Buffer& num_confirmed() const { return slots_.num_confirmed(); }
  // What the latest depth map has confirmed of an anchor.
  struct Confirmed {
    std::uint32_t anchor = 0;
    double share = 0;  // of its surfels, 0 to 1
    std::int64_t num_surfels = 0;
    // Of what is known of its surfels, the share that its own depth map has seen: the mean of one
    // over the number of depth maps, per block.
    double own_share = 1;
  };
  // Downloads num_confirmed and num_there; once per depth map. Of the anchors of these blocks,
  // which are in order.
  std::vector<Confirmed> TakeConfirmed(std::span<const std::uint32_t> blocks);
  // Downloads num_there of these blocks, of which surfels may have been removed.
  void TakeNumThere(std::span<const std::uint32_t> blocks);
  // Per block on the device; undefined where it is not in use.
  const std::vector<std::uint32_t>& anchors() const { return slots_.anchors(); }
  // The blocks on the device, in the order of the model.
  const std::vector<std::uint32_t>& order();

  // Blocks on the device without bounds: of new surfels, and of such that were replaced.
  std::vector<std::uint32_t> Unbounded() const;
  void SetBounded();

  // Another view looks at the model: what it sees must stay on the device until the next one does.
  void BeginView() { ++view_; }
  // It sees these blocks.
  void Seen(std::span<const std::uint32_t> blocks);
  bool HasAnchorsOut() const { return num_out_ > 0; }
  // What surrounds an anchor that is not on the device, and its blocks: float4 each as bounds().
  struct Outside {
    std::uint32_t anchor = 0;
    const Surfels::Float4& whole;
    std::span<const Surfels::Float4> blocks;
  };
  std::vector<Outside> AnchorsOut() const;
  // Brings it back. Others that the view does not see go where there is no room. Throws Error
  // (kOutOfMemory) where that is not enough.
  void BringIn(std::uint32_t anchor);

  // Makes room on the device for so many slots more: by growing; at the limit by sending away
  // anchors that the latest view does not see, those first that were seen longest ago; where these
  // are not enough, beyond the limit, with a warning. False where the device has no room, or the
  // model may not have so many.
  bool MakeRoom(std::uint32_t num_slots);
  // Grows, to have room on the device for slots up to `size`.
  void Reserve(std::uint32_t size) { slots_.Reserve(size); }
  // The stages are about to fill so many slots, for which there is room, with surfels of this
  // anchor, the last one: in these blocks.
  std::vector<std::uint32_t> BeginInsert(std::uint32_t anchor, std::uint32_t num_inserted);
  // They have done it, and filled up the last block; and have emptied `num_removed` slots.
  void EndInsert(std::uint32_t num_inserted, std::uint32_t num_removed);
  void Remove(std::uint32_t num_removed) { num_surfels_ -= num_removed; }
  // Closes the gaps that removed surfels left in anchors of the latest views, where a quarter of
  // an anchor's blocks is to be won, keeping the order.
  void CloseGaps();
  // Of all anchors, where there is a block to be won.
  void CloseAllGaps();

  // Removes the surfels anchored to this depth map or a later one.
  void RemoveAnchoredFrom(std::uint32_t first_anchor);

  // All of the model, or of one anchor, in their order; what is not on the device is read where it
  // is, and stays there.
  Surfels Download() const;
  Surfels Download(std::uint32_t anchor) const;
  // An anchor at a time.
  void ForEachAnchor(const std::function<void(std::uint32_t, const Surfels&)>& take) const;
  // What is in these slots of the device.
  Surfels DownloadSlots(std::uint32_t first, std::uint32_t end) const {
    return slots_.DownloadSlots(first, end);
  }
  // Replaces all. Each block of one anchor, anchors in their order.
  void Upload(const Surfels& surfels);
  // The surfels of an anchor that has none yet: on the device as far as there is room.
  void Add(std::uint32_t anchor, Surfels surfels);
  // When the surfels of an anchor were given other slots, or bounds, last; the larger, the later.
  std::uint64_t LayoutVersionOf(std::uint32_t anchor) const;
  std::uint64_t layout_version() const { return layout_version_; }

  // All that an anchor has but its surfels, for a saved state.
  struct BlocksOfAnchor {
    std::uint32_t num_slots = 0;
    std::vector<float> observations;  // per block: depth maps that have seen a surfel of it, mean
    std::vector<std::uint8_t>
        num_there;  // per block: surfels that are not removed, as last counted
    std::vector<Surfels::Float4> bounds;  // per block; empty where they are not known
  };
  BlocksOfAnchor BlocksOf(std::uint32_t anchor) const;
  // Takes it over; of an anchor that has none yet.
  void Restore(std::uint32_t anchor, BlocksOfAnchor blocks, Surfels surfels);
  void SetNumSurfels(std::uint32_t num_surfels) { num_surfels_ = num_surfels; }

 private:
  struct OfAnchor {
    std::uint32_t num_slots = 0;
    std::vector<std::uint32_t> blocks;  // on the device; empty where it is not
    std::vector<float> observations;
    std::vector<std::uint8_t> num_there;
    bool is_bounded = false;
    std::uint64_t last_view = 0;  // that saw it
    std::uint64_t layout_version = 0;
    // Where it is not on the device.
    bool is_out = false;
    SurfelDepot::Ticket ticket = 0;
    Surfels::Float4 whole{};
    std::vector<Surfels::Float4> bounds;
  };

  OfAnchor& At(std::uint32_t anchor);
  std::vector<std::uint32_t> TakeBlocks(std::uint32_t anchor, std::uint32_t num_blocks);
  void FreeBlocks(std::span<const std::uint32_t> blocks);
  void Place(std::uint32_t anchor, const Surfels& surfels);
  static void SetBlocks(OfAnchor& of, const Surfels& surfels);
  void PutSomewhere(std::uint32_t anchor, std::vector<Surfels::Float4> bounds, Surfels surfels);
  void PutAway(OfAnchor& of, Surfels surfels, std::vector<Surfels::Float4> bounds);
  void SendAway(std::uint32_t anchor);
  void SendAwayFor(std::uint32_t num_slots);
  bool HasGaps(const OfAnchor& of) const;
  void CloseUp(std::uint32_t anchor);

  Residency residency_;
  std::uint32_t max_slots_;
  SurfelSlots slots_;
  std::uint32_t num_slots_ = 0;
  std::uint32_t num_surfels_ = 0;
  std::uint64_t view_ = 1;
  std::uint64_t layout_version_ = 0;
  std::uint32_t num_out_ = 0;
  std::vector<OfAnchor> of_anchor_;
  std::vector<std::uint32_t> place_of_;   // per block on the device: among those of its anchor
  std::vector<std::uint32_t> unbounded_;  // anchors
  std::vector<std::uint32_t> with_gaps_;  // anchors
  std::vector<std::uint32_t> order_;
  bool has_order_ = true;
  std::uint32_t inserting_ = 0;  // anchor
};

}  // namespace mono3d
