// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/submap.h"

#include <algorithm>
#include <cassert>
#include <functional>

#include "fusion/state_archive.h"

namespace mono3d {

std::size_t Submap::IndexOf(std::uint32_t anchor) const {
  const auto found = std::ranges::lower_bound(anchors_, anchor);
  assert(found != anchors_.end() && *found == anchor);
  return static_cast<std::size_t>(found - anchors_.begin());
}

void Submap::Add(std::uint32_t anchor, const Similarity& S_world_kf) {
  assert(anchors_.empty() || anchors_.back() < anchor);
  anchors_.push_back(anchor);
  S_submap_kf_.push_back(S_world_submap_.Inverse() * S_world_kf);
}

Similarity Submap::S_world_kf(std::uint32_t anchor) const {
  return S_world_submap_ * S_submap_kf_[IndexOf(anchor)];
}

void Submap::Place(std::uint32_t anchor, const Similarity& S_world_kf) {
  S_submap_kf_[IndexOf(anchor)] = S_world_submap_.Inverse() * S_world_kf;
}

void Submap::TakeOver(const Submap& other) {
  for (const std::uint32_t anchor : other.anchors_) {
    const auto place = std::ranges::lower_bound(anchors_, anchor);
    const auto index = place - anchors_.begin();
    anchors_.insert(place, anchor);
    S_submap_kf_.insert(S_submap_kf_.begin() + index,
                        S_world_submap_.Inverse() * other.S_world_kf(anchor));
  }
}

void Submap::RemoveFrom(std::uint32_t first_anchor) {
  const auto first = std::ranges::lower_bound(anchors_, first_anchor);
  S_submap_kf_.resize(static_cast<std::size_t>(first - anchors_.begin()));
  anchors_.erase(first, anchors_.end());
}

void Submap::Renumber(std::uint32_t first_anchor, int first_id) {
  id_ += first_id;
  for (std::uint32_t& anchor : anchors_) anchor += first_anchor;
}

template <typename Archive>
void Submap::Exchange(Archive& archive) {
  archive.Number(id_);
  ExchangeSimilarity(archive, S_world_submap_);
  archive.Array(anchors_);
  ExchangeSimilarities(archive, S_submap_kf_);
  RequireSound(archive,
               anchors_.size() == S_submap_kf_.size() &&
                   std::ranges::adjacent_find(anchors_, std::greater_equal<>()) == anchors_.end());
}

template void Submap::Exchange(ByteWriter& archive);
template void Submap::Exchange(ByteReader& archive);

}  // namespace mono3d
