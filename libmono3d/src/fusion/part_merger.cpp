// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/part_merger.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "fusion/overlap_views.h"
#include "fusion/state_archive.h"
#include "fusion/view.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// After a correction, views from which overlapping parts are merged.
constexpr std::size_t kMaxMergingViews = 6;
// Of parts that have become one: more, for they may lie upon each other all over.
constexpr std::size_t kMaxJoiningViews = 24;

constexpr std::uint32_t kMergeMargin_px = 1;  // so that no rounding matters at the image's border

}  // namespace

void PartMerger::AnchorsRemovedFrom(std::uint32_t first_anchor) {
  S_world_kf_merged_.resize(std::min<std::size_t>(S_world_kf_merged_.size(), first_anchor));
  std::erase_if(pending_, [&](std::uint32_t view) { return view >= first_anchor; });
}

void PartMerger::FindPending() {
  if (!is_due_) return;
  is_due_ = false;
  const std::vector<std::uint32_t> views = ViewsOfOverlap(model_.anchors, S_world_kf_merged_);
  if (views.empty()) return;  // what has not moved apart by a pixel may yet
  std::vector<std::uint32_t> all;
  std::ranges::set_union(pending_, views, std::back_inserter(all));
  pending_ = Evenly(all, kMaxMergingViews);
  S_world_kf_merged_ = model_.anchors.S_world_kf();
}

std::int64_t PartMerger::MergeNearest(const PlacedAnchor& view) {
  FindPending();
  const Eigen::Vector3d centre = Centre(view);
  const auto nearest = std::ranges::min_element(pending_, {}, [&](std::uint32_t number) {
    return (Centre(model_.anchors.Placed(number)) - centre).squaredNorm();
  });
  if (nearest == pending_.end()) return 0;
  const std::uint32_t from = *nearest;
  pending_.erase(nearest);
  return MergeFrom({&from, 1});
}

std::int64_t PartMerger::MergePending() {
  FindPending();
  return MergeFrom(std::exchange(pending_, {}));
}

std::int64_t PartMerger::MergeAcross(const std::vector<bool>& is_other) {
  S_world_kf_merged_ = model_.anchors.S_world_kf();
  return MergeFrom(Evenly(ViewsAcross(model_.anchors, is_other), kMaxJoiningViews));
}

std::vector<std::uint32_t> PartMerger::TakeChangedAnchors() {
  return std::exchange(changed_anchors_, {});
}

// Without memory for it things stay double.
std::int64_t PartMerger::MergeFrom(std::span<const std::uint32_t> views) {
  std::int64_t num_merged = 0;
  try {
    for (const std::uint32_t view : views) num_merged += MergeFromOne(view);
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string("overlapping parts are not merged: ") + error.what());
  }
  merger_.End();
  return num_merged;
}

std::uint32_t PartMerger::MergeFromOne(std::uint32_t view) {
  SurfelStorage& surfels = model_.surfels;
  DepthMap seen;
  seen.camera = model_.anchors.anchor(view).camera;
  ViewParams params = MakeViewParams(seen, context_.options, surfels.size(), model_.anchors.size());
  anchors_.Set(context_.device, model_.anchors.S_world_kf()[view],
               model_.anchors.S_world_surfels());
  const ModelView model_view{params, anchors_};
  context_.culler.FindVisible(context_.recorder, {&model_view, 1}, kMergeMargin_px, surfels,
                              visible_, context_.times);
  params.num_surfels = surfels.size();  // some may have come to the device
  std::vector<std::uint32_t> end_of_older = model_.anchors.EndOfOlderParts();
  const auto anchor_of = [&](std::uint32_t block) { return surfels.anchors()[block]; };
  for (std::uint32_t& end : end_of_older) {
    const auto first = std::ranges::lower_bound(visible_.numbers(), end, {}, anchor_of);
    end = static_cast<std::uint32_t>(first - visible_.numbers().begin()) * kSurfelsPerBlock;
  }
  const std::uint32_t num_removed =
      merger_.Merge(context_.recorder, context_.kernels, params, anchors_, end_of_older, surfels,
                    visible_, context_.times);
  surfels.Remove(num_removed);
  if (num_removed == 0) return 0;
  context_.culler.Bound(context_.recorder, visible_, surfels.size(), surfels);
  context_.recorder.Submit(context_.times);
  surfels.TakeNumThere(visible_.numbers());
  for (const std::uint32_t block : visible_.numbers()) {
    changed_anchors_.push_back(surfels.anchors()[block]);
  }
  return num_removed;
}

template <typename Archive>
void PartMerger::Exchange(Archive& archive) {
  archive.Number(is_due_);
  ExchangeSimilarities(archive, S_world_kf_merged_);
  archive.Array(pending_);
  archive.Array(changed_anchors_);
  const auto is_there = [&](std::uint32_t number) { return number < model_.anchors.size(); };
  RequireSound(archive, S_world_kf_merged_.size() <= model_.anchors.size() &&
                            std::ranges::all_of(pending_, is_there) &&
                            std::ranges::all_of(changed_anchors_, is_there));
}

template void PartMerger::Exchange(ByteWriter& archive);
template void PartMerger::Exchange(ByteReader& archive);

}  // namespace mono3d
