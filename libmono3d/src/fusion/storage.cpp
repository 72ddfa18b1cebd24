// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/storage.h"

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "gpu/device_handle.h"
#include "gpu/recorder.h"

namespace mono3d {
namespace {

// Capacities are multiples of this: buffers of whole MiB.
constexpr std::uint32_t kCapacityStep = 65'536;

std::uint32_t MaxSurfels(const Device& device, std::uint32_t wanted) {
  const DeviceLimits& limits = Limits(device);
  const std::uint64_t per_buffer = std::min<std::uint64_t>(
      limits.max_storage_buffer_bytes / sizeof(Surfels::Float4), limits.max_texel_buffer_elements);
  const std::uint64_t num_blocks = std::min<std::uint64_t>(wanted, per_buffer) / kSurfelsPerBlock;
  return static_cast<std::uint32_t>(std::max<std::uint64_t>(num_blocks, 1)) * kSurfelsPerBlock;
}

std::size_t BytesOfBlocks(std::uint32_t num_surfels, std::size_t bytes_per_block) {
  return std::size_t{DivideRoundingUp(num_surfels, kSurfelsPerBlock)} * bytes_per_block;
}

void AppendOne(const Surfels& from, std::size_t i, Surfels& to) {
  to.position_radius.push_back(from.position_radius[i]);
  to.normal_weight.push_back(from.normal_weight[i]);
  to.history.push_back(from.history[i]);
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

SurfelStorage::SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels)
    : device_(std::move(device)), max_size_(MaxSurfels(*device_, max_surfels)) {
  Allocate(std::min(kCapacityStep, max_size_));
}

void SurfelStorage::Allocate(std::uint32_t capacity) {
  const std::size_t bytes = std::size_t{capacity} * sizeof(Surfels::Float4);
  position_radius_ = Buffer(device_, bytes, "fusion/position_radius");
  normal_weight_ = Buffer(device_, bytes, "fusion/normal_weight");
  history_ = Buffer(device_, bytes, "fusion/history");
  association_ = Buffer(device_, std::size_t{capacity} * 4, "fusion/association");
  bounds_ =
      Buffer(device_, BytesOfBlocks(capacity, sizeof(Surfels::Float4)), "fusion/block_bounds");
  anchor_of_block_ =
      Buffer(device_, BytesOfBlocks(capacity, sizeof(std::uint32_t)), "fusion/anchor_of_block");
  num_confirmed_ =
      Buffer(device_, BytesOfBlocks(capacity, sizeof(std::uint32_t)), "fusion/num_confirmed");
  capacity_ = capacity;
}

void SurfelStorage::Reserve(Recorder& recorder, std::uint32_t size) {
  assert(size <= max_size_);
  if (size <= capacity_) return;
  // By half at least, so that a growing model is copied a bounded number of times.
  const std::uint64_t wanted = std::max<std::uint64_t>(size, std::uint64_t{capacity_} * 3 / 2);
  const std::uint64_t rounded = (wanted + kCapacityStep - 1) / kCapacityStep * kCapacityStep;

  const auto grow = [&](Buffer& buffer, std::size_t element_bytes, std::uint32_t capacity) {
    Buffer larger(device_, element_bytes * capacity, buffer.name());
    if (size_ > 0) recorder.Copy(buffer, 0, larger, 0, element_bytes * size_);
    return larger;
  };
  const auto capacity = static_cast<std::uint32_t>(std::min<std::uint64_t>(rounded, max_size_));
  Buffer position_radius = grow(position_radius_, sizeof(Surfels::Float4), capacity);
  Buffer normal_weight = grow(normal_weight_, sizeof(Surfels::Float4), capacity);
  Buffer history = grow(history_, sizeof(Surfels::Uint4), capacity);
  Buffer association = grow(association_, sizeof(std::uint32_t), capacity);
  const auto grow_blocks = [&](Buffer& buffer, std::size_t block_bytes) {
    Buffer larger(device_, BytesOfBlocks(capacity, block_bytes), buffer.name());
    if (size_ > 0) recorder.Copy(buffer, 0, larger, 0, BytesOfBlocks(size_, block_bytes));
    return larger;
  };
  Buffer bounds = grow_blocks(bounds_, sizeof(Surfels::Float4));
  Buffer anchor_of_block = grow_blocks(anchor_of_block_, sizeof(std::uint32_t));
  Buffer num_confirmed = grow_blocks(num_confirmed_, sizeof(std::uint32_t));
  recorder.Submit();
  position_radius_ = std::move(position_radius);
  normal_weight_ = std::move(normal_weight);
  history_ = std::move(history);
  association_ = std::move(association);
  bounds_ = std::move(bounds);
  anchor_of_block_ = std::move(anchor_of_block);
  num_confirmed_ = std::move(num_confirmed);
  capacity_ = capacity;
}

std::uint32_t SurfelStorage::FirstSlotOf(std::uint32_t anchor) const {
  const auto first = std::ranges::lower_bound(anchors_, anchor);
  return static_cast<std::uint32_t>(first - anchors_.begin()) * kSurfelsPerBlock;
}

std::vector<SurfelStorage::Confirmed> SurfelStorage::TakeConfirmed(
    std::span<const std::uint32_t> blocks) {
  std::vector<Confirmed> confirmed;
  if (blocks.empty()) return confirmed;
  std::vector<std::uint32_t> counts(anchors_.size());
  num_confirmed_.Download(std::span(counts));
  for (const std::uint32_t block : blocks) {  // in the order of their anchors
    const float share = static_cast<float>(counts[block]) / kSurfelsPerBlock;
    observations_[block] += share;
    if (confirmed.empty() || confirmed.back().anchor != anchors_[block]) {
      confirmed.push_back({anchors_[block], 0, 0, 0});
    }
    confirmed.back().share += share;
    confirmed.back().num_surfels += counts[block];
  }
  for (Confirmed& of : confirmed) {
    const std::uint32_t first = FirstSlotOf(of.anchor) / kSurfelsPerBlock;
    const std::uint32_t end = FirstSlotOf(of.anchor + 1) / kSurfelsPerBlock;
    for (std::uint32_t block = first; block < end; ++block)
      of.own_share += 1 / observations_[block];
    of.share /= end - first;
    of.own_share /= end - first;
  }
  return confirmed;
}

void SurfelStorage::BeginInsert(std::uint32_t anchor, std::uint32_t num_inserted) {
  assert(size_ % kSurfelsPerBlock == 0 && size_ + WholeBlocks(num_inserted) <= capacity_);
  const std::vector<std::uint32_t> added(WholeBlocks(num_inserted) / kSurfelsPerBlock, anchor);
  if (added.empty()) return;
  anchor_of_block_.Upload(std::span(added), size_ / kSurfelsPerBlock * sizeof(std::uint32_t));
}

void SurfelStorage::EndInsert(std::uint32_t anchor, std::uint32_t num_inserted,
                              std::uint32_t num_removed) {
  const std::uint32_t num_slots = WholeBlocks(num_inserted);
  anchors_.insert(anchors_.end(), num_slots / kSurfelsPerBlock, anchor);
  observations_.insert(observations_.end(), num_slots / kSurfelsPerBlock, 1);
  size_ += num_slots;
  num_unused_ += num_slots - num_inserted;
  num_removed_ += num_removed;
  assert(size_ <= capacity_ && num_removed_ + num_unused_ <= size_);
}

// On the host: it happens once in many depth maps, and costs a copy of the model.
void SurfelStorage::Compact() {
  if (num_removed_ > 0) Upload(InWholeBlocks(Download()));
}

void SurfelStorage::Append(const Surfels& more, std::uint32_t first_anchor) {
  Surfels surfels = Download();
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(surfels.position_radius, more.position_radius);
  append(surfels.normal_weight, more.normal_weight);
  const std::uint32_t in_both_halves = first_anchor << 16U | first_anchor;
  for (Surfels::Uint4 history : more.history) {
    history[2] += in_both_halves;
    history[3] += first_anchor;
    surfels.history.push_back(history);
  }
  Upload(surfels);
}

void SurfelStorage::RemoveAnchoredFrom(std::uint32_t first_anchor) {
  Surfels surfels = Download(0, std::min(FirstSlotOf(first_anchor), size_));
  Upload(InWholeBlocks(surfels));
}

Surfels SurfelStorage::Download(std::uint32_t first, std::uint32_t end) const {
  Surfels surfels;
  surfels.resize(end - first);
  const std::size_t offset_bytes = std::size_t{first} * sizeof(Surfels::Float4);
  position_radius_.Download(std::span(surfels.position_radius), offset_bytes);
  normal_weight_.Download(std::span(surfels.normal_weight), offset_bytes);
  history_.Download(std::span(surfels.history), offset_bytes);
  return surfels;
}

void SurfelStorage::Upload(const Surfels& surfels) {
  assert(surfels.size() <= capacity_);
  position_radius_.Upload(std::span<const Surfels::Float4>(surfels.position_radius));
  normal_weight_.Upload(std::span<const Surfels::Float4>(surfels.normal_weight));
  history_.Upload(std::span<const Surfels::Uint4>(surfels.history));
  ++num_uploads_;
  size_ = static_cast<std::uint32_t>(surfels.size());
  num_removed_ = 0;
  num_unused_ = 0;
  num_bounded_ = 0;
  anchors_.clear();
  observations_.clear();
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
    anchors_.push_back(AnchorOf(surfels, first));
    observations_.push_back(num_there == 0 ? 1.0F
                                           : std::max(1.0F, static_cast<float>(num_observations) /
                                                                static_cast<float>(num_there)));
    num_unused_ += static_cast<std::uint32_t>(end - first) - num_there;
  }
  anchor_of_block_.Upload(std::span<const std::uint32_t>(anchors_));
}

SurfelStorage::Layout SurfelStorage::GetLayout() const {
  Layout layout{max_size_,    size_,    num_removed_,  num_unused_,
                num_bounded_, anchors_, observations_, {}};
  layout.bounds.resize(num_bounded_ / kSurfelsPerBlock);
  bounds_.Download(std::span(layout.bounds));
  return layout;
}

bool SurfelStorage::Restore(Recorder& recorder, const Layout& layout) {
  const std::size_t num_blocks = layout.size / kSurfelsPerBlock;
  const bool is_possible =
      layout.size <= std::min(layout.max_size, max_size_) && layout.size % kSurfelsPerBlock == 0 &&
      std::uint64_t{layout.num_removed} + layout.num_unused <= layout.size &&
      layout.num_bounded <= layout.size && layout.num_bounded % kSurfelsPerBlock == 0 &&
      layout.bounds.size() == layout.num_bounded / kSurfelsPerBlock &&
      layout.anchors.size() == num_blocks && layout.observations.size() == num_blocks &&
      std::ranges::is_sorted(layout.anchors);
  if (!is_possible) return false;
  size_ = 0;  // what is there need not be copied
  max_size_ = std::min(max_size_, layout.max_size);
  Reserve(recorder, layout.size);
  ++num_uploads_;
  size_ = layout.size;
  num_removed_ = layout.num_removed;
  num_unused_ = layout.num_unused;
  num_bounded_ = layout.num_bounded;
  anchors_ = layout.anchors;
  observations_ = layout.observations;
  anchor_of_block_.Upload(std::span<const std::uint32_t>(anchors_));
  bounds_.Upload(std::span<const Surfels::Float4>(layout.bounds));
  return true;
}

void SurfelStorage::UploadSlots(std::uint32_t first, const Surfels& surfels) {
  assert(first + surfels.size() <= size_);
  const std::size_t offset_bytes = std::size_t{first} * sizeof(Surfels::Float4);
  position_radius_.Upload(std::span<const Surfels::Float4>(surfels.position_radius), offset_bytes);
  normal_weight_.Upload(std::span<const Surfels::Float4>(surfels.normal_weight), offset_bytes);
  history_.Upload(std::span<const Surfels::Uint4>(surfels.history), offset_bytes);
}

}  // namespace mono3d
