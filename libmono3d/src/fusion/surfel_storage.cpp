// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_storage.h"

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
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted, per_buffer));
}

std::size_t BoundsBytes(std::uint32_t num_surfels) {
  return std::size_t{DivideRoundingUp(num_surfels, kSurfelsPerBlock)} * sizeof(Surfels::Float4);
}

}  // namespace

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
  bounds_ = Buffer(device_, BoundsBytes(capacity), "fusion/block_bounds");
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
  Buffer bounds(device_, BoundsBytes(capacity), bounds_.name());
  if (size_ > 0) recorder.Copy(bounds_, 0, bounds, 0, BoundsBytes(size_));
  recorder.Submit();
  position_radius_ = std::move(position_radius);
  normal_weight_ = std::move(normal_weight);
  history_ = std::move(history);
  association_ = std::move(association);
  bounds_ = std::move(bounds);
  capacity_ = capacity;
}

void SurfelStorage::Update(std::uint32_t num_inserted, std::uint32_t num_removed) {
  size_ += num_inserted;
  num_removed_ += num_removed;
  assert(size_ <= capacity_ && num_removed_ <= size_);
}

// On the host: it happens once in many depth maps, and costs a copy of the model.
void SurfelStorage::Compact() {
  if (num_removed_ > 0) KeepRemaining(Download());
}

void SurfelStorage::Append(const Surfels& more, std::uint32_t first_depth_map) {
  Surfels surfels = Download();
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(surfels.position_radius, more.position_radius);
  append(surfels.normal_weight, more.normal_weight);
  const std::uint32_t in_both_halves = first_depth_map << 16U | first_depth_map;
  for (Surfels::Uint4 history : more.history) {
    history[2] += in_both_halves;
    history[3] += first_depth_map;
    surfels.history.push_back(history);
  }
  Upload(surfels);
}

void SurfelStorage::RemoveAnchoredFrom(std::uint32_t first_depth_map) {
  Surfels surfels = Download();
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (Low16(surfels.history[i][3]) >= first_depth_map) surfels.normal_weight[i][3] = 0;
  }
  KeepRemaining(std::move(surfels));
}

void SurfelStorage::KeepRemaining(Surfels surfels) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (IsRemoved(surfels, i)) continue;
    surfels.position_radius[kept] = surfels.position_radius[i];
    surfels.normal_weight[kept] = surfels.normal_weight[i];
    surfels.history[kept] = surfels.history[i];
    ++kept;
  }
  surfels.resize(kept);
  Upload(surfels);
}

Surfels SurfelStorage::Download() const {
  Surfels surfels;
  surfels.resize(size_);
  position_radius_.Download(std::span(surfels.position_radius));
  normal_weight_.Download(std::span(surfels.normal_weight));
  history_.Download(std::span(surfels.history));
  return surfels;
}

void SurfelStorage::Upload(const Surfels& surfels) {
  assert(surfels.size() <= capacity_);
  position_radius_.Upload(std::span<const Surfels::Float4>(surfels.position_radius));
  normal_weight_.Upload(std::span<const Surfels::Float4>(surfels.normal_weight));
  history_.Upload(std::span<const Surfels::Uint4>(surfels.history));
  size_ = static_cast<std::uint32_t>(surfels.size());
  num_removed_ = 0;
  num_bounded_ = 0;
  first_slots_.clear();
  for (std::uint32_t i = 0; i < size_; ++i) {
    const std::uint32_t anchor = Low16(surfels.history[i][3]);
    if (anchor >= first_slots_.size()) first_slots_.resize(anchor + 1, i);
  }
}

}  // namespace mono3d
