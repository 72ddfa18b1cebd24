// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "fusion/stored_depth_map.h"

namespace mono3d {

// A depth map that is kept: one that waits to be tried again, or one of the latest in the model.
struct KeptMap {
  StoredDepthMap map;
  int num_attempts = 1;         // to fuse it, so far
  std::uint32_t map_index = 0;  // in the model, of those that are in it
};

// Depth maps that are kept, in a bounded number.
class KeptMaps {
 public:
  // Some 97 maps of 768x448 or 3 of 4000x3000.
  static constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

  // Of maps of more than `max_bytes` together fewer are kept, one at least.
  explicit KeptMaps(int max_size, std::size_t max_bytes = kMaxBytes)
      : max_size_(max_size), max_bytes_(max_bytes) {}

  std::size_t size() const { return maps_.size(); }
  std::size_t num_bytes() const;
  bool empty() const { return maps_.empty(); }
  // The oldest goes when there are too many.
  void Add(KeptMap map);
  std::optional<KeptMap> TakeOldest();
  std::optional<KeptMap> TakeNewest();
  void Clear() { maps_.clear(); }
  // All of them become some of `others`, of a model that takes over this one's; those of the model
  // have numbers from `first_map_index` on there.
  void MoveInto(KeptMaps& others, std::uint32_t first_map_index);

  // For a saved state, the depth maps themselves apart; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);
  StoredDepthMap& map(std::size_t number) { return maps_[number].map; }

 private:
  int max_size_;
  std::size_t max_bytes_;
  std::deque<KeptMap> maps_;
};

}  // namespace mono3d
