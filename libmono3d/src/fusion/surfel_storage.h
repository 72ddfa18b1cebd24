// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fusion/surfel.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"

namespace mono3d {

// The surfels of the model on the device, one buffer per field of Surfels, growing in steps.
// Slots 0 to size() - 1 are in use; removed surfels keep theirs until Compact().
class SurfelStorage {
 public:
  // Never holds more than `max_surfels`, nor more than one buffer of the device does.
  SurfelStorage(std::shared_ptr<Device> device, std::uint32_t max_surfels);

  std::uint32_t size() const { return size_; }
  std::uint32_t max_size() const { return max_size_; }
  std::uint32_t num_removed() const { return num_removed_; }

  const Buffer& position_radius() const { return position_radius_; }
  const Buffer& normal_weight() const { return normal_weight_; }
  const Buffer& history() const { return history_; }
  const Buffer& association() const { return association_; }  // uint per slot, for the stages
  // float4 per block of kSurfelsPerBlock: centre and radius of what surrounds its surfels.
  const Buffer& bounds() const { return bounds_; }
  // Surfels whose blocks have bounds: none once surfels were replaced.
  std::uint32_t num_bounded() const { return num_bounded_; }
  void SetBounded(std::uint32_t num_surfels) { num_bounded_ = num_surfels; }

  // Per depth map of the model the first slot of those anchored to it or to a later one: slots are
  // in the order of their anchors.
  const std::vector<std::uint32_t>& first_slots() const { return first_slots_; }
  // The next surfels are anchored to this depth map.
  void BeginDepthMap(std::uint32_t map_index) { first_slots_.resize(map_index + 1, size_); }

  // Makes room for slots up to `size`, at most max_size(). What is there stays.
  void Reserve(Recorder& recorder, std::uint32_t size);
  // From now on max_size() is what there is room for.
  void StopGrowing() { max_size_ = capacity_; }
  // The stages have filled `num_inserted` slots behind the others, and emptied `num_removed`.
  void Update(std::uint32_t num_inserted, std::uint32_t num_removed);
  // Closes the gaps that removed surfels left, keeping the order.
  void Compact();

  // Adds surfels behind the others, for which there is room, with their depth maps numbered from
  // `first_depth_map` on: behind those of the others.
  void Append(const Surfels& more, std::uint32_t first_depth_map);

  // Removes the surfels anchored to this depth map or a later one, and closes the gaps.
  void RemoveAnchoredFrom(std::uint32_t first_depth_map);

  Surfels Download() const;
  void Upload(const Surfels& surfels);  // replaces all; within the reserved room

 private:
  // Closes the gaps of what has been downloaded, and uploads it.
  void KeepRemaining(Surfels surfels);
  void Allocate(std::uint32_t capacity);

  std::shared_ptr<Device> device_;
  std::uint32_t max_size_;
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t num_removed_ = 0;
  std::uint32_t num_bounded_ = 0;
  std::vector<std::uint32_t> first_slots_;
  Buffer position_radius_;
  Buffer normal_weight_;
  Buffer history_;
  Buffer association_;
  Buffer bounds_;
};

}  // namespace mono3d
