// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/kept_maps.h"

#include <algorithm>
#include <utility>

#include "fusion/state_archive.h"

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

void KeptMaps::MoveInto(KeptMaps& others, std::uint32_t first_map_index) {
  while (!maps_.empty()) {
    maps_.front().map_index += first_map_index;
    others.Add(std::move(maps_.front()));
    maps_.pop_front();
  }
}

template <typename Archive>
void KeptMaps::Exchange(Archive& archive) {
  std::uint64_t num_maps = maps_.size();
  archive.Number(num_maps);
  RequireSound(archive, num_maps <= static_cast<std::uint64_t>(std::max(max_size_, 0)));
  if constexpr (kIsReader<Archive>) maps_.resize(num_maps);
  for (KeptMap& kept : maps_) {
    archive.Number(kept.num_attempts);
    archive.Number(kept.map_index);
  }
}

template void KeptMaps::Exchange(ByteWriter& archive);
template void KeptMaps::Exchange(ByteReader& archive);

}  // namespace mono3d
