// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/kept_maps.h"

#include <utility>

namespace mono3d {

void KeptMaps::Add(KeptMap map) {
  maps_.push_back(std::move(map));
  const auto is_too_much = [&] {
    return static_cast<int>(size()) > max_size_ || (size() > 1 && num_bytes() > max_bytes_);
  };
  while (is_too_much()) maps_.pop_front();
}

std::size_t KeptMaps::num_bytes() const {
  std::size_t sum = 0;
  for (const KeptMap& kept : maps_) sum += kept.map.num_bytes();
  return sum;
}

std::optional<KeptMap> KeptMaps::TakeOldest() {
  if (maps_.empty()) return std::nullopt;
  KeptMap map = std::move(maps_.front());
  maps_.pop_front();
  return map;
}

std::optional<KeptMap> KeptMaps::TakeNewest() {
  if (maps_.empty()) return std::nullopt;
  KeptMap map = std::move(maps_.back());
  maps_.pop_back();
  return map;
}

void KeptMaps::MoveInto(KeptMaps& others, const MapJoin& join, std::uint32_t first_map_index) {
  for (KeptMap& kept : maps_) {
    kept.map.Scale(join.S_this_other.scale());
    kept.map.frame.T_world_cam = join.S_this_other * kept.map.frame.T_world_cam;
    kept.map.frame.map_id = join.map_id;
    kept.scale *= join.S_this_other.scale();
    kept.map_index += first_map_index;
  }
  Correct(join.corrections);
  while (!maps_.empty()) {
    others.Add(std::move(maps_.front()));
    maps_.pop_front();
  }
}

void KeptMaps::Correct(std::span<const KeyframeCorrection> corrections) {
  for (KeptMap& kept : maps_) {
    for (const KeyframeCorrection& correction : corrections) {
      if (correction.id != kept.map.frame.keyframe_id) continue;
      kept.map.Scale(correction.scale / kept.scale);
      kept.map.frame.T_world_cam = correction.T_world_cam;
      kept.scale = correction.scale;
    }
  }
}

}  // namespace mono3d
