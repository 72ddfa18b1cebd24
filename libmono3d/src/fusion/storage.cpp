// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/storage.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "fusion/surfel_bounds.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
SurfelStorage::SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels,
                             const Residency& residency)
    : residency_(residency),
      max_slots_(SlotsFor(max_surfels)),
      slots_(std::move(device), max_slots_,
             residency.depot == nullptr ? max_slots_ : SlotsFor(residency.max_surfels)) {}

bool SurfelStorage::MakeRoom(std::uint32_t num_slots) {
  if (num_slots > max_slots_ - num_slots_) return false;
  if (slots_.Grow(num_slots)) return true;
  SendAwayFor(num_slots);
  if (slots_.num_free() >= num_slots) return true;
  const std::uint64_t needed = slots_.NeededFor(num_slots);
  if (needed > slots_.max_limit()) return false;
  constexpr std::uint32_t kBytesPerMb = 1U << 20U;
  constexpr std::uint64_t kBytesPerSlot = kBytesPerSurfel + sizeof(std::uint32_t);
  const auto mb_of = [](std::uint64_t slots) {
    return std::to_string((slots * kBytesPerSlot + kBytesPerMb - 1) / kBytesPerMb);
  };
  // A little more, so that the next view does not say it again.
  const std::uint64_t raised = needed + needed / 8;
  Log(LogLevel::kWarning, "one view sees more of the model than may be on the device: " +
                              mb_of(needed) + " MB instead of " + mb_of(slots_.limit()));
  slots_.SetLimit(raised);
  return slots_.Grow(num_slots);
}

SurfelStorage::OfAnchor& SurfelStorage::At(std::uint32_t anchor) {
  if (anchor >= of_anchor_.size()) of_anchor_.resize(anchor + 1);
  return of_anchor_[anchor];
}

std::uint32_t SurfelStorage::NumSlotsOf(std::uint32_t anchor) const {
  return anchor < of_anchor_.size() ? of_anchor_[anchor].num_slots : 0;
}

std::uint64_t SurfelStorage::LayoutVersionOf(std::uint32_t anchor) const {
  return anchor < of_anchor_.size() ? of_anchor_[anchor].layout_version : 0;
}

// Free ones, for which there must be room.
std::vector<std::uint32_t> SurfelStorage::TakeBlocks(std::uint32_t anchor,
                                                     std::uint32_t num_blocks) {
  OfAnchor& of = At(anchor);
  std::vector<std::uint32_t> blocks = slots_.Take(anchor, num_blocks);
  place_of_.resize(std::max<std::size_t>(place_of_.size(), slots_.num_blocks()));
  for (const std::uint32_t block : blocks) {
    place_of_[block] = static_cast<std::uint32_t>(of.blocks.size());
    of.blocks.push_back(block);
  }
  const bool is_last = anchor + 1 == of_anchor_.size();
  if (is_last && has_order_) {
    order_.insert(order_.end(), blocks.begin(), blocks.end());
  } else {
    has_order_ = false;
  }
  of.last_view = view_;
  return blocks;
}

void SurfelStorage::FreeBlocks(std::span<const std::uint32_t> blocks) {
  if (blocks.empty()) return;
  slots_.Free(blocks);
  has_order_ = false;
}

void SurfelStorage::Place(std::uint32_t anchor, const Surfels& surfels) {
  const auto num_blocks = NumBlocks(static_cast<std::uint32_t>(surfels.size()));
  slots_.Upload(TakeBlocks(anchor, num_blocks), surfels);
}

const std::vector<std::uint32_t>& SurfelStorage::order() {
  if (!has_order_) {
    order_.clear();
    for (const OfAnchor& of : of_anchor_) {
      order_.insert(order_.end(), of.blocks.begin(), of.blocks.end());
    }
    has_order_ = true;
  }
  return order_;
}

std::vector<std::uint32_t> SurfelStorage::Unbounded() const {
  std::vector<std::uint32_t> blocks;
  for (const std::uint32_t anchor : unbounded_) {
    const std::vector<std::uint32_t>& of = of_anchor_[anchor].blocks;
    blocks.insert(blocks.end(), of.begin(), of.end());
  }
  return blocks;
}

void SurfelStorage::SetBounded() {
  if (unbounded_.empty()) return;
  ++layout_version_;
  for (const std::uint32_t anchor : unbounded_) {
    of_anchor_[anchor].is_bounded = true;
    of_anchor_[anchor].layout_version = layout_version_;
  }
  unbounded_.clear();
}

void SurfelStorage::Seen(std::span<const std::uint32_t> blocks) {
  for (const std::uint32_t block : blocks) of_anchor_[anchors()[block]].last_view = view_;
}

std::vector<SurfelStorage::Outside> SurfelStorage::AnchorsOut() const {
  std::vector<Outside> outside;
  for (std::uint32_t i = 0; i < of_anchor_.size(); ++i) {
    const OfAnchor& of = of_anchor_[i];
    if (of.is_out) outside.push_back({i, of.whole, of.bounds});
  }
  return outside;
}

void SurfelStorage::PutAway(OfAnchor& of, Surfels surfels, std::vector<Surfels::Float4> bounds) {
  of.ticket = residency_.depot->Put(std::move(surfels));
  of.bounds = std::move(bounds);
  of.whole = Around(of.bounds);
  of.is_out = true;
  ++num_out_;
}

void SurfelStorage::SendAway(std::uint32_t anchor) {
  OfAnchor& of = of_anchor_[anchor];
  Surfels surfels = Download(anchor);
  std::vector<Surfels::Float4> bounds =
      of.is_bounded ? slots_.DownloadBounds(of.blocks) : BoundsOf(surfels);
  std::erase(unbounded_, anchor);
  PutAway(of, std::move(surfels), std::move(bounds));
  FreeBlocks(std::exchange(of.blocks, {}));
}

// Those first that no view has seen for the longest time.
void SurfelStorage::SendAwayFor(std::uint32_t num_slots) {
  if (residency_.depot == nullptr) return;
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t i = 0; i < of_anchor_.size(); ++i) {
    if (!of_anchor_[i].blocks.empty() && of_anchor_[i].last_view != view_) candidates.push_back(i);
  }
  std::ranges::stable_sort(candidates, {},
                           [&](std::uint32_t i) { return of_anchor_[i].last_view; });
  for (const std::uint32_t anchor : candidates) {
    if (slots_.num_free() >= num_slots) return;
    SendAway(anchor);
  }
}

void SurfelStorage::BringIn(std::uint32_t anchor) {
  OfAnchor& of = of_anchor_[anchor];
  // It has its slots in the model already.
  num_slots_ -= of.num_slots;
  const bool has_room = MakeRoom(WholeBlocks(of.num_slots));
  num_slots_ += of.num_slots;
  if (!has_room) {
    throw Error("one view sees more of the model than the device has room for",
                ErrorCode::kOutOfMemory);
  }
  Place(anchor, residency_.depot->Take(of.ticket));
  of.is_out = false;
  --num_out_;
  if (of.is_bounded) {
    slots_.UploadBounds(of.blocks, of.bounds);
  } else {
    unbounded_.push_back(anchor);
  }
  of.bounds = {};
}

void SurfelStorage::TakeNumThere(std::span<const std::uint32_t> blocks) {
  if (blocks.empty()) return;
  std::vector<std::uint32_t> counts(slots_.num_blocks());
  slots_.num_there().Download(std::span(counts));
  std::uint32_t last = 0xFFFFFFFFU;
  const auto end_anchor = [&] {
    if (last < of_anchor_.size() && HasGaps(of_anchor_[last])) with_gaps_.push_back(last);
  };
  for (const std::uint32_t block : blocks) {
    if (anchors()[block] != last) end_anchor();
    last = anchors()[block];
    of_anchor_[last].num_there[place_of_[block]] = static_cast<std::uint8_t>(counts[block]);
  }
  end_anchor();
}

std::vector<SurfelStorage::Confirmed> SurfelStorage::TakeConfirmed(
    std::span<const std::uint32_t> blocks) {
  std::vector<Confirmed> confirmed;
  if (blocks.empty()) return confirmed;
  TakeNumThere(blocks);
  std::vector<std::uint32_t> counts(slots_.num_blocks());
  slots_.num_confirmed().Download(std::span(counts));
  for (const std::uint32_t block : blocks) {  // in the order of their anchors
    const std::uint32_t anchor = anchors()[block];
    const float share = static_cast<float>(counts[block]) / kSurfelsPerBlock;
    of_anchor_[anchor].observations[place_of_[block]] += share;
    if (confirmed.empty() || confirmed.back().anchor != anchor) {
      confirmed.push_back({anchor, 0, 0, 0});
    }
    confirmed.back().share += share;
    confirmed.back().num_surfels += counts[block];
  }
  for (Confirmed& of : confirmed) {
    const std::vector<float>& observations = of_anchor_[of.anchor].observations;
    for (const float number : observations) of.own_share += 1 / number;
    of.share /= static_cast<double>(observations.size());
    of.own_share /= static_cast<double>(observations.size());
  }
  return confirmed;
}

std::vector<std::uint32_t> SurfelStorage::BeginInsert(std::uint32_t anchor,
                                                      std::uint32_t num_inserted) {
  inserting_ = anchor;
  if (num_inserted == 0) return {};
  return TakeBlocks(anchor, NumBlocks(num_inserted));
}

void SurfelStorage::EndInsert(std::uint32_t num_inserted, std::uint32_t num_removed) {
  num_surfels_ += num_inserted;
  num_surfels_ -= num_removed;
  if (num_inserted == 0) return;
  OfAnchor& of = of_anchor_[inserting_];
  for (std::uint32_t left = num_inserted; left > 0;) {
    const std::uint32_t here = std::min(left, kSurfelsPerBlock);
    of.observations.push_back(1);
    of.num_there.push_back(static_cast<std::uint8_t>(here));
    left -= here;
  }
  of.num_slots += WholeBlocks(num_inserted);
  num_slots_ += WholeBlocks(num_inserted);
  of.is_bounded = false;
  of.layout_version = ++layout_version_;
  unbounded_.push_back(inserting_);
}

// Whether a quarter of its blocks is to be won.
bool SurfelStorage::HasGaps(const OfAnchor& of) const {
  const auto num_there = std::accumulate(of.num_there.begin(), of.num_there.end(), 0U);
  return 4 * std::size_t{NumBlocks(num_there)} <= 3 * of.num_there.size();
}

void SurfelStorage::CloseGaps() {
  std::vector<std::uint32_t> anchors = std::exchange(with_gaps_, {});
  std::ranges::sort(anchors);
  anchors.erase(std::unique(anchors.begin(), anchors.end()), anchors.end());
  for (const std::uint32_t anchor : anchors) CloseUp(anchor);
}

void SurfelStorage::CloseAllGaps() {
  with_gaps_.clear();
  for (std::uint32_t i = 0; i < of_anchor_.size(); ++i) {
    const OfAnchor& of = of_anchor_[i];
    const auto num_there = std::accumulate(of.num_there.begin(), of.num_there.end(), 0U);
    if (NumBlocks(num_there) < of.num_there.size()) CloseUp(i);
  }
}

// Wherever it is.
void SurfelStorage::CloseUp(std::uint32_t anchor) {
  OfAnchor& of = of_anchor_[anchor];
  const bool was_out = std::exchange(of.is_out, false);
  const Surfels gaps = was_out ? residency_.depot->Take(of.ticket) : Download(anchor);
  if (was_out) --num_out_;
  Surfels closed = InWholeBlocks(gaps);
  num_slots_ -= of.num_slots;
  std::erase(unbounded_, anchor);
  SetBlocks(of, closed);
  num_slots_ += of.num_slots;
  of.layout_version = ++layout_version_;
  if (was_out) {
    if (of.num_slots > 0) {
      std::vector<Surfels::Float4> bounds = BoundsOf(closed);
      PutAway(of, std::move(closed), std::move(bounds));
    }
    return;
  }
  const std::size_t num_blocks = NumBlocks(of.num_slots);
  const std::vector<std::uint32_t> freed(
      of.blocks.begin() + static_cast<std::ptrdiff_t>(num_blocks), of.blocks.end());
  of.blocks.resize(num_blocks);
  slots_.Upload(of.blocks, closed);
  FreeBlocks(freed);
  if (num_blocks > 0) unbounded_.push_back(anchor);
}

// What is known of its blocks by its surfels alone; they have no bounds.
void SurfelStorage::SetBlocks(OfAnchor& of, const Surfels& surfels) {
  of.num_slots = static_cast<std::uint32_t>(surfels.size());
  of.is_bounded = false;
  of.observations.clear();
  of.num_there.clear();
  for (std::size_t first = 0; first < surfels.size(); first += kSurfelsPerBlock) {
    const std::size_t end = std::min(first + kSurfelsPerBlock, surfels.size());
    std::uint32_t num_there = 0;
    std::uint32_t num_observations = 0;
    for (std::size_t i = first; i < end; ++i) {
      assert(AnchorOf(surfels, i) == AnchorOf(surfels, first));
      if (IsRemoved(surfels, i)) continue;
      ++num_there;
      num_observations += Low16(surfels.history[i][1]);
    }
    of.num_there.push_back(static_cast<std::uint8_t>(num_there));
    of.observations.push_back(num_there == 0 ? 1.0F
                                             : std::max(1.0F, static_cast<float>(num_observations) /
                                                                  static_cast<float>(num_there)));
  }
}

void SurfelStorage::RemoveAnchoredFrom(std::uint32_t first_anchor) {
  for (std::uint32_t i = first_anchor; i < of_anchor_.size(); ++i) {
    OfAnchor& of = of_anchor_[i];
    if (first_anchor > 0) num_surfels_ -= NumThere(Download(i));
    num_slots_ -= of.num_slots;
    if (of.is_out) {
      residency_.depot->Remove(of.ticket);
      --num_out_;
    }
    FreeBlocks(of.blocks);
  }
  if (first_anchor < of_anchor_.size()) of_anchor_.resize(first_anchor);
  const auto is_gone = [&](std::uint32_t anchor) { return anchor >= first_anchor; };
  std::erase_if(unbounded_, is_gone);
  std::erase_if(with_gaps_, is_gone);
  if (of_anchor_.empty()) {  // as new
    num_surfels_ = 0;
    slots_.FreeAll();
  }
}

Surfels SurfelStorage::Download() const {
  Surfels all;
  ForEachAnchor([&](std::uint32_t, const Surfels& surfels) { Append(surfels, all); });
  return all;
}

void SurfelStorage::ForEachAnchor(
    const std::function<void(std::uint32_t, const Surfels&)>& take) const {
  for (std::uint32_t i = 0; i < of_anchor_.size(); ++i) {
    if (of_anchor_[i].num_slots > 0) take(i, Download(i));
  }
}

Surfels SurfelStorage::Download(std::uint32_t anchor) const {
  if (anchor >= of_anchor_.size()) return {};
  const OfAnchor& of = of_anchor_[anchor];
  return of.is_out ? residency_.depot->Get(of.ticket) : slots_.Download(of.blocks, of.num_slots);
}

void SurfelStorage::Upload(const Surfels& surfels) {
  RemoveAnchoredFrom(0);
  for (std::size_t first = 0; first < surfels.size();) {
    const std::uint32_t anchor = AnchorOf(surfels, first);
    std::size_t end = first;
    while (end < surfels.size() && AnchorOf(surfels, end) == anchor) {
      end = std::min(end + kSurfelsPerBlock, surfels.size());
    }
    const auto part = [&](const auto& values) {
      return std::remove_cvref_t<decltype(values)>(
          values.begin() + static_cast<std::ptrdiff_t>(first),
          values.begin() + static_cast<std::ptrdiff_t>(end));
    };
    Add(anchor,
        {part(surfels.position_radius), part(surfels.normal_weight), part(surfels.history)});
    first = end;
  }
}

void SurfelStorage::Add(std::uint32_t anchor, Surfels surfels) {
  OfAnchor& of = At(anchor);
  assert(of.num_slots == 0);
  SetBlocks(of, surfels);
  num_surfels_ += std::accumulate(of.num_there.begin(), of.num_there.end(), 0U);
  PutSomewhere(anchor, {}, std::move(surfels));
}

void SurfelStorage::Restore(std::uint32_t anchor, BlocksOfAnchor blocks, Surfels surfels) {
  OfAnchor& of = At(anchor);
  assert(of.num_slots == 0);
  of.num_slots = blocks.num_slots;
  of.observations = std::move(blocks.observations);
  of.num_there = std::move(blocks.num_there);
  of.is_bounded = !blocks.bounds.empty();
  PutSomewhere(anchor, std::move(blocks.bounds), std::move(surfels));
}

// On the device while there is room. `bounds`: empty where the device has to find them.
void SurfelStorage::PutSomewhere(std::uint32_t anchor, std::vector<Surfels::Float4> bounds,
                                 Surfels surfels) {
  OfAnchor& of = of_anchor_[anchor];
  num_slots_ += of.num_slots;
  of.layout_version = ++layout_version_;
  if (of.num_slots == 0) return;
  if (!slots_.Grow(WholeBlocks(of.num_slots))) {
    if (residency_.depot == nullptr) {
      throw Error("the device has no room for the model", ErrorCode::kOutOfMemory);
    }
    if (!of.is_bounded) bounds = BoundsOf(surfels);
    return PutAway(of, std::move(surfels), std::move(bounds));
  }
  Place(anchor, surfels);
  // A last block may be a part of one.
  if (of.blocks.back() + 1 == slots_.num_blocks()) {
    slots_.ShortenLast(WholeBlocks(of.num_slots) - of.num_slots);
  }
  of.last_view = 0;
  if (of.is_bounded) {
    slots_.UploadBounds(of.blocks, bounds);
  } else {
    unbounded_.push_back(anchor);
  }
}

SurfelStorage::BlocksOfAnchor SurfelStorage::BlocksOf(std::uint32_t anchor) const {
  if (anchor >= of_anchor_.size()) return {};
  const OfAnchor& of = of_anchor_[anchor];
  BlocksOfAnchor blocks{of.num_slots, of.observations, of.num_there, {}};
  if (!of.is_bounded) return blocks;
  blocks.bounds = of.is_out ? of.bounds : slots_.DownloadBounds(of.blocks);
  return blocks;
}

}  // namespace mono3d
