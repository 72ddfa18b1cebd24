// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/storage.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "gpu/device_handle.h"
#include "gpu/recorder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Capacities are multiples of this: buffers of whole MiB.
constexpr std::uint32_t kCapacityStep = 65'536;

std::uint32_t InBlocks(std::uint64_t num_surfels) {
  constexpr std::uint64_t kMost = 0xFFFFFFFFU / kSurfelsPerBlock;
  const std::uint64_t num_blocks = std::min(num_surfels / kSurfelsPerBlock, kMost);
  return static_cast<std::uint32_t>(std::max<std::uint64_t>(num_blocks, 1)) * kSurfelsPerBlock;
}

std::uint64_t SurfelsOfBuffer(const Device& device) {
  const DeviceLimits& limits = Limits(device);
  return std::min<std::uint64_t>(limits.max_storage_buffer_bytes / sizeof(Surfels::Float4),
                                 limits.max_texel_buffer_elements);
}

std::uint32_t NumBlocks(std::uint32_t num_surfels) {
  return DivideRoundingUp(num_surfels, kSurfelsPerBlock);
}

std::size_t BytesOfBlocks(std::uint32_t num_surfels, std::size_t bytes_per_block) {
  return std::size_t{NumBlocks(num_surfels)} * bytes_per_block;
}

void AppendOne(const Surfels& from, std::size_t i, Surfels& to) {
  to.position_radius.push_back(from.position_radius[i]);
  to.normal_weight.push_back(from.normal_weight[i]);
  to.history.push_back(from.history[i]);
}

void AppendAll(const Surfels& from, Surfels& to) {
  const auto append = [](const auto& more, auto& all) {
    all.insert(all.end(), more.begin(), more.end());
  };
  append(from.position_radius, to.position_radius);
  append(from.normal_weight, to.normal_weight);
  append(from.history, to.history);
}

void FillUpBlock(Surfels& surfels) {
  if (surfels.size() == 0) return;
  const std::uint32_t anchor = AnchorOf(surfels, surfels.size() - 1);
  while (surfels.size() % kSurfelsPerBlock != 0) {
    surfels.position_radius.push_back({});
    surfels.normal_weight.push_back({});
    surfels.history.push_back({0, 0, 0, anchor});
  }
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

std::uint32_t NumThere(const Surfels& surfels) {
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < surfels.size(); ++i) count += IsRemoved(surfels, i) ? 0 : 1;
  return count;
}

// As shaders/fusion/bound_blocks.comp has it, but for rounding; good enough to say what may be seen
// of a block that the device has not bounded yet.
std::vector<Surfels::Float4> BoundsOf(const Surfels& surfels) {
  std::vector<Surfels::Float4> bounds;
  for (std::size_t first = 0; first < surfels.size(); first += kSurfelsPerBlock) {
    std::array<float, 3> least{3.4e38F, 3.4e38F, 3.4e38F};
    std::array<float, 3> most{-3.4e38F, -3.4e38F, -3.4e38F};
    const std::size_t end = std::min(first + kSurfelsPerBlock, surfels.size());
    bool is_empty = true;
    for (std::size_t i = first; i < end; ++i) {
      if (IsRemoved(surfels, i)) continue;
      is_empty = false;
      for (std::size_t k = 0; k < 3; ++k) {
        least.at(k) = std::min(least.at(k), surfels.position_radius[i].at(k));
        most.at(k) = std::max(most.at(k), surfels.position_radius[i].at(k));
      }
    }
    Surfels::Float4 sphere{0, 0, 0, -1};
    if (!is_empty) {
      float squared = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        sphere.at(k) = 0.5F * (least.at(k) + most.at(k));
        squared += (most.at(k) - least.at(k)) * (most.at(k) - least.at(k));
      }
      sphere[3] = 0.501F * std::sqrt(squared);
    }
    bounds.push_back(sphere);
  }
  return bounds;
}

// A sphere around all of them.
Surfels::Float4 Around(std::span<const Surfels::Float4> spheres) {
  std::array<double, 3> least{}, most{};
  bool is_empty = true;
  for (const Surfels::Float4& sphere : spheres) {
    if (sphere[3] < 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const double from = double{sphere.at(k)} - sphere[3];
      const double to = double{sphere.at(k)} + sphere[3];
      least.at(k) = is_empty ? from : std::min(least.at(k), from);
      most.at(k) = is_empty ? to : std::max(most.at(k), to);
    }
    is_empty = false;
  }
  if (is_empty) return {0, 0, 0, -1};
  Surfels::Float4 whole{};
  double squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    whole.at(k) = static_cast<float>(0.5 * (least.at(k) + most.at(k)));
    squared += (most.at(k) - least.at(k)) * (most.at(k) - least.at(k));
  }
  whole[3] = static_cast<float>(0.501 * std::sqrt(squared));
  return whole;
}

}  // namespace

Surfels InWholeBlocks(const Surfels& surfels) {
  Surfels closed;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    const bool is_of_next =
        closed.size() > 0 && AnchorOf(surfels, i) != AnchorOf(closed, closed.size() - 1);
    if (is_of_next) FillUpBlock(closed);
    AppendOne(surfels, i, closed);
  }
  FillUpBlock(closed);
  return closed;
}

SurfelStorage::SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels,
                             const Residency& residency)
    : device_(std::move(device)),
      residency_(residency),
      recorder_(device_),
      max_slots_(InBlocks(max_surfels)),
      max_capacity_(InBlocks(std::min<std::uint64_t>(max_slots_, SurfelsOfBuffer(*device_)))),
      limit_(residency.depot == nullptr
                 ? max_capacity_
                 : std::min(max_capacity_, InBlocks(residency.max_surfels))) {
  Allocate(std::min(kCapacityStep, limit_));
}

void SurfelStorage::Allocate(std::uint32_t capacity) {
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
  place_of_.resize(NumBlocks(capacity));
}

std::uint32_t SurfelStorage::num_free() const {
  return static_cast<std::uint32_t>(free_.size()) * kSurfelsPerBlock + capacity_ -
         WholeBlocks(size_);
}

// For so many slots more, within limit_.
bool SurfelStorage::Grow(std::uint32_t num_slots) {
  const std::uint64_t needed = std::uint64_t{capacity_} - num_free() + num_slots;
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
    limit_ = max_capacity_ = capacity_;
    return false;
  }
  return true;
}

void SurfelStorage::Reserve(std::uint32_t size) {
  if (size > capacity_) (void)Grow(size - (capacity_ - num_free()));
}

bool SurfelStorage::MakeRoom(std::uint32_t num_slots) {
  if (num_slots > max_slots_ - num_slots_) return false;
  if (Grow(num_slots)) return true;
  SendAwayFor(num_slots);
  if (num_free() >= num_slots) return true;
  const std::uint64_t needed = std::uint64_t{capacity_} - num_free() + num_slots;
  if (needed > max_capacity_) return false;
  constexpr std::uint32_t kBytesPerMb = 1U << 20U;
  constexpr std::uint64_t kBytesPerSlot = kBytesPerSurfel + sizeof(std::uint32_t);
  const auto mb_of = [](std::uint64_t slots) {
    return std::to_string((slots * kBytesPerSlot + kBytesPerMb - 1) / kBytesPerMb);
  };
  // A little more, so that the next view does not say it again.
  const std::uint64_t raised = needed + needed / 8;
  Log(LogLevel::kWarning, "one view sees more of the model than may be on the device: " +
                              mb_of(needed) + " MB instead of " + mb_of(limit_));
  limit_ = InBlocks(std::min<std::uint64_t>(raised, max_capacity_));
  return Grow(num_slots);
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
  assert(std::uint64_t{num_blocks} * kSurfelsPerBlock <= num_free());
  OfAnchor& of = At(anchor);
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
  for (const std::uint32_t block : blocks) {
    anchor_of_[block] = anchor;
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
  const std::vector<std::uint32_t> added(blocks.size(), anchor);
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    anchor_of_block_.Upload(Part(added, at, count), first * sizeof(std::uint32_t));
  });
  return blocks;
}

void SurfelStorage::FreeBlocks(std::span<const std::uint32_t> blocks) {
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
  has_order_ = false;
}

void SurfelStorage::UploadBlocks(std::span<const std::uint32_t> blocks, const Surfels& surfels) {
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

template <typename T>
std::vector<T> SurfelStorage::DownloadPerBlock(const Buffer& buffer,
                                               std::span<const std::uint32_t> blocks) const {
  std::vector<T> values(blocks.size());
  ForEachRun(blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
    buffer.Download(Part(values, at, count), first * sizeof(T));
  });
  return values;
}

void SurfelStorage::Place(std::uint32_t anchor, const Surfels& surfels) {
  const auto num_blocks = NumBlocks(static_cast<std::uint32_t>(surfels.size()));
  UploadBlocks(TakeBlocks(anchor, num_blocks), surfels);
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
  for (const std::uint32_t block : blocks) of_anchor_[anchor_of_[block]].last_view = view_;
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
      of.is_bounded ? DownloadPerBlock<Surfels::Float4>(bounds_, of.blocks) : BoundsOf(surfels);
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
    if (num_free() >= num_slots) return;
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
    ForEachRun(of.blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
      bounds_.Upload(Part(std::as_const(of.bounds), at, count), first * sizeof(Surfels::Float4));
    });
  } else {
    unbounded_.push_back(anchor);
  }
  of.bounds = {};
}

void SurfelStorage::TakeNumThere(std::span<const std::uint32_t> blocks) {
  if (blocks.empty()) return;
  std::vector<std::uint32_t> counts(NumBlocks(size_));
  num_there_.Download(std::span(counts));
  std::uint32_t last = 0xFFFFFFFFU;
  const auto end_anchor = [&] {
    if (last < of_anchor_.size() && HasGaps(of_anchor_[last])) with_gaps_.push_back(last);
  };
  for (const std::uint32_t block : blocks) {
    if (anchor_of_[block] != last) end_anchor();
    last = anchor_of_[block];
    of_anchor_[last].num_there[place_of_[block]] = static_cast<std::uint8_t>(counts[block]);
  }
  end_anchor();
}

std::vector<SurfelStorage::Confirmed> SurfelStorage::TakeConfirmed(
    std::span<const std::uint32_t> blocks) {
  std::vector<Confirmed> confirmed;
  if (blocks.empty()) return confirmed;
  TakeNumThere(blocks);
  std::vector<std::uint32_t> counts(NumBlocks(size_));
  num_confirmed_.Download(std::span(counts));
  for (const std::uint32_t block : blocks) {  // in the order of their anchors
    const std::uint32_t anchor = anchor_of_[block];
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
  UploadBlocks(of.blocks, closed);
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
    size_ = 0;
    free_.clear();
  }
}

Surfels SurfelStorage::Download() const {
  Surfels all;
  ForEachAnchor([&](std::uint32_t, const Surfels& surfels) { AppendAll(surfels, all); });
  return all;
}

void SurfelStorage::ForEachAnchor(
    const std::function<void(std::uint32_t, const Surfels&)>& take) const {
  for (std::uint32_t i = 0; i < of_anchor_.size(); ++i) {
    if (of_anchor_[i].num_slots > 0) take(i, Download(i));
  }
}

Surfels SurfelStorage::Download(std::uint32_t anchor) const {
  Surfels surfels;
  if (anchor >= of_anchor_.size()) return surfels;
  const OfAnchor& of = of_anchor_[anchor];
  if (of.is_out) return residency_.depot->Get(of.ticket);
  surfels.resize(of.num_slots);
  ForEachRun(of.blocks, [&](std::uint32_t block, std::size_t count, std::size_t at) {
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

Surfels SurfelStorage::DownloadSlots(std::uint32_t first, std::uint32_t end) const {
  Surfels surfels;
  surfels.resize(end - first);
  const std::size_t offset_bytes = std::size_t{first} * sizeof(Surfels::Float4);
  position_radius_.Download(std::span(surfels.position_radius), offset_bytes);
  normal_weight_.Download(std::span(surfels.normal_weight), offset_bytes);
  history_.Download(std::span(surfels.history), offset_bytes);
  return surfels;
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
  if (!Grow(WholeBlocks(of.num_slots))) {
    if (residency_.depot == nullptr) {
      throw Error("the device has no room for the model", ErrorCode::kOutOfMemory);
    }
    if (!of.is_bounded) bounds = BoundsOf(surfels);
    return PutAway(of, std::move(surfels), std::move(bounds));
  }
  Place(anchor, surfels);
  // A last block may be a part of one.
  if (of.blocks.back() + 1 == NumBlocks(size_)) {
    size_ -= WholeBlocks(of.num_slots) - of.num_slots;
  }
  of.last_view = 0;
  if (of.is_bounded) {
    ForEachRun(of.blocks, [&](std::uint32_t first, std::size_t count, std::size_t at) {
      bounds_.Upload(Part(std::as_const(bounds), at, count), first * sizeof(Surfels::Float4));
    });
  } else {
    unbounded_.push_back(anchor);
  }
}

SurfelStorage::BlocksOfAnchor SurfelStorage::BlocksOf(std::uint32_t anchor) const {
  if (anchor >= of_anchor_.size()) return {};
  const OfAnchor& of = of_anchor_[anchor];
  BlocksOfAnchor blocks{of.num_slots, of.observations, of.num_there, {}};
  if (!of.is_bounded) return blocks;
  blocks.bounds = of.is_out ? of.bounds : DownloadPerBlock<Surfels::Float4>(bounds_, of.blocks);
  return blocks;
}

}  // namespace mono3d
