// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/fusion_context.h"
#include "fusion/overlap_merger.h"

namespace mono3d {

// Merges parts of the model that come to lie upon each other when anchors move. It does so as some
// anchors see them; after a correction with the depth maps that come next, a view at a time.
class PartMerger {
 public:
  PartMerger(FusionContext& context, SurfelModel& model)
      : context_(context), model_(model), merger_(context.device) {}

  // The model has an anchor more.
  void AnchorAdded() { S_world_kf_merged_.push_back(model_.anchors.S_world_kf().back()); }
  // It has these alone.
  void AnchorsRemovedFrom(std::uint32_t first_anchor);
  // Anchors have moved.
  void AnchorsMoved() { is_due_ = true; }

  // Each returns the number of surfels that became one with another, and adds to changed_anchors().
  // Of what is to be merged, what one anchor sees: the one that looks nearest to where `view` does.
  std::int64_t MergeNearest(const PlacedAnchor& view);
  // All of it.
  std::int64_t MergePending();
  // What two parts both show, `is_other` telling the two apart by their anchors.
  std::int64_t MergeAcross(const std::vector<bool>& is_other);

  // Anchors whose surfels have changed since this was asked last.
  std::vector<std::uint32_t> TakeChangedAnchors();

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  void FindPending();
  std::int64_t MergeFrom(std::span<const std::uint32_t> views);
  std::uint32_t MergeFromOne(std::uint32_t view);

  FusionContext& context_;
  SurfelModel& model_;
  OverlapMerger merger_;
  AnchorTable anchors_;
  BlockList visible_;
  bool is_due_ = false;                        // anchors have moved since pending_ was found
  std::vector<Similarity> S_world_kf_merged_;  // per anchor: where it was then
  std::vector<std::uint32_t> pending_;         // from which to merge
  std::vector<std::uint32_t> changed_anchors_;
};

}  // namespace mono3d
