// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/depth_map_fuser.h"

#include <algorithm>
#include <bit>
#include <string>

#include "fusion/coarsen.h"
#include "fusion/selection.h"
#include "fusion/state_archive.h"
#include "fusion/view.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// A 64th of the surfels; coarser is not worth having.
constexpr std::uint32_t kMaxMergeRadius_px = 8;

constexpr std::uint32_t kFuseMargin_px = 1;  // so that no rounding matters at the image's border

}  // namespace

ViewParams DepthMapFuser::Params(const DepthMap& map) const {
  ViewParams params =
      MakeViewParams(map, context_.options, model_.surfels.size(), model_.anchors.size());
  params.merge_radius_px = merge_radius_px_;
  return params;
}

bool DepthMapFuser::Upload(const DepthMap& map) {
  if (map.camera.width != width_px_ || map.camera.height != height_px_) {
    buffers_ = DepthMapBuffers(context_.device, map.camera.width, map.camera.height);
    width_px_ = map.camera.width;
    height_px_ = map.camera.height;
  }
  num_candidates_ = buffers_.Write(context_.device, [&](const PackedPixels& to) {
    return Pack(map, context_.options.with_confidence, to);
  });
  if (num_candidates_ == 0) return false;
  context_.kernels.Prepare(context_.recorder, Params(map), buffers_);
  return true;
}

std::optional<DepthMapFuser::Counts> DepthMapFuser::Fuse(const DepthMap& map, const DepthMap& whole,
                                                         const Anchor& anchor,
                                                         const Similarity& S_world_kf, int submap) {
  SurfelStorage& surfels = model_.surfels;
  // With all its pixels new, is there room? If not, gaps may be enough; surfels stay what they are.
  if (surfels.max_slots() - surfels.num_slots() < num_candidates_) surfels.CloseAllGaps();
  anchors_.Set(context_.device, S_world_kf, model_.anchors.S_world_surfels());
  const auto associate = [&] { Associate(map, submap); };
  if (!Look(associate)) return std::nullopt;
  while (!surfels.MakeRoom(WholeBlocks(num_new_))) {
    if (!Coarsen() || !Look(associate)) return std::nullopt;
  }

  if (!model_.anchors.empty() && model_.anchors.SubmapOfLatest() != submap) past_views_.Clear();
  const std::uint32_t number = model_.anchors.size();
  model_.anchors.Add(anchor, S_world_kf, submap);
  Counts counts;
  counts.exposure = CorrectColours(map);
  counts.num_removed = ChangeSurfels(map, number);
  surfels.EndInsert(num_new_, static_cast<std::uint32_t>(counts.num_removed));
  counts.num_inferred = FuseInferred(map, whole, number, submap);
  past_views_.Push(context_.device, map, number, buffers_);
  counts.num_merged = num_candidates_ - num_new_;
  counts.num_inserted = num_new_;
  return counts;
}

bool DepthMapFuser::Look(const std::function<void()>& look) {
  for (;;) {
    try {
      look();
      return true;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kOutOfMemory || !model_.surfels.HasAnchorsOut()) throw;
      Log(LogLevel::kWarning, error.what());
      if (!Coarsen()) return false;
    }
  }
}

// What the depth map says of each surfel, and which of its pixels are new: num_new_, and in
// buffers_.new_pixels. Leaves the model alone.
// Of the surfels those of one submap: another one may be off, and must not be drawn to it.
void DepthMapFuser::Associate(const DepthMap& map, int submap) {
  ViewParams params = Params(map);
  const ModelView view{params, anchors_};
  context_.culler.FindVisible(context_.recorder, {&view, 1}, kFuseMargin_px, model_.surfels,
                              visible_, context_.times);
  params.num_surfels = model_.surfels.size();  // some may have come to the device
  if (model_.anchors.num_submaps() > 1) {
    visible_.Set(context_.device, BlocksOfSubmap(visible_.numbers(), model_.surfels.anchors(),
                                                 model_.anchors, submap));
  }
  Recorder& recorder = context_.recorder;
  const FusionKernels& kernels = context_.kernels;
  kernels.AssociateAndDraw(recorder, params, anchors_, buffers_, buffers_.index_map, model_.surfels,
                           visible_);
  kernels.SelectNew(recorder, params, anchors_, buffers_, buffers_.index_map, model_.surfels,
                    visible_);
  recorder.Submit(context_.times);
  std::vector<std::uint32_t> selected = buffers_.selected.Download<std::uint32_t>();
  if (merge_radius_px_ > 1) KeepEveryPixel(merge_radius_px_, params.width_px, selected);
  const std::vector<std::uint32_t> new_pixels = ListSelected(selected);
  buffers_.new_pixels.Upload(std::span(new_pixels));
  num_new_ = static_cast<std::uint32_t>(new_pixels.size());
  new_spheres_ = SpheresOfNew(params, new_pixels, buffers_.depths());
}

// The colours of the model are those of its first image's exposure: what is uploaded comes to it,
// as far as the depth map shows what is there already.
Exposure DepthMapFuser::CorrectColours(const DepthMap& map) {
  colours_.clear();
  if (map.bgr.empty()) return {};
  const ViewParams params = Params(map);
  if (model_.surfels.num_slots() == 0) latest_exposure_ = {};
  compared_.Set(
      context_.device,
      ExposureSample(visible_.numbers(), NumExposureCells(params.width_px, params.height_px)));
  context_.kernels.ExposureCells(context_.recorder, params, buffers_, buffers_.exposure_cells,
                                 model_.surfels, compared_);
  context_.recorder.Submit(context_.times);
  const auto cells = buffers_.exposure_cells.Download<ExposureCell>();
  latest_exposure_ = EstimateExposure(cells, latest_exposure_);
  Log(LogLevel::kDebug, "image of frame " + std::to_string(map.frame_index) + ": exposure gain " +
                            std::to_string(latest_exposure_.gain) + ", offset " +
                            std::to_string(latest_exposure_.offset));
  colours_ = CorrectedColours(map.bgr, latest_exposure_);
  buffers_.colour.Upload(std::span<const std::uint32_t>(colours_));
  return latest_exposure_;
}

// Returns the number of surfels removed.
std::uint32_t DepthMapFuser::ChangeSurfels(const DepthMap& map, std::uint32_t number) {
  SurfelStorage& surfels = model_.surfels;
  added_.Set(context_.device, surfels.BeginInsert(number, num_new_));
  ViewParams params = Params(map);
  params.map_index = number;
  params.num_new = num_new_;
  Recorder& recorder = context_.recorder;
  const FusionKernels& kernels = context_.kernels;
  recorder.Fill(buffers_.num_removed, 0);
  kernels.Merge(recorder, params, anchors_, buffers_, buffers_.num_removed, surfels, visible_);
  context_.culler.Bound(recorder, visible_, params.num_surfels, surfels);
  kernels.Insert(recorder, params, buffers_, surfels, added_);
  ReviewNew(params, number);
  recorder.Submit(context_.times);
  NoteChanges();
  return buffers_.num_removed.Download<std::uint32_t>().front();
}

std::int64_t DepthMapFuser::FuseInferred(const DepthMap& map, const DepthMap& whole,
                                         std::uint32_t number, int submap) {
  const InferredFuser::View view{Params(map), anchors_, buffers_, visible_, number, submap};
  inferred_.GiveWay(view);
  const auto& changed = inferred_.changed_anchors();
  changed_anchors_.insert(changed_anchors_.end(), changed.begin(), changed.end());
  return inferred_.Fuse(view, whole, colours_, past_views_);
}

void DepthMapFuser::NoteChanges() {
  changed_anchors_.clear();
  for (const auto& confirmed : model_.surfels.TakeConfirmed(visible_.numbers())) {
    changed_anchors_.push_back(confirmed.anchor);
    model_.anchors.LatestConfirmed(confirmed.anchor, confirmed.share, confirmed.own_share);
  }
}

// What the depth maps before this one say of its new surfels: they cannot confirm them, or there
// would be a surfel there already, but they may have seen through them, or something before them.
void DepthMapFuser::ReviewNew(const ViewParams& of_map, std::uint32_t number) {
  if (num_new_ == 0) return;
  for (PastView& past : past_views_.views()) {
    ViewParams params = MakeViewParams(past.map, context_.options, of_map.num_surfels, number);
    params.is_past = 1;
    past.LookAt(context_.device, params, model_.anchors, number, added_.numbers(), new_spheres_);
    context_.kernels.Associate(context_.recorder, params, past.anchors, past.buffers,
                               model_.surfels, past.new_blocks);
    context_.kernels.ClearFreeSpace(context_.recorder, params, buffers_.num_removed, model_.surfels,
                                    past.new_blocks);
  }
}

bool DepthMapFuser::Coarsen() {
  if (merge_radius_px_ >= kMaxMergeRadius_px) return false;
  merge_radius_px_ *= 2;
  SurfelStorage& surfels = model_.surfels;
  const std::uint32_t before = surfels.num_surfels();
  for (SurfelStorage* storage : {&surfels, &model_.inferred}) {
    storage->Upload(
        InWholeBlocks(Coarsened(storage->Download(), model_.anchors.S_world_surfels())));
  }
  Log(LogLevel::kWarning, "the model is full with " + std::to_string(before) +
                              " surfels: made coarser, " + std::to_string(surfels.num_surfels()) +
                              " remain, new ones are " + std::to_string(merge_radius_px_) +
                              " px apart");
  return true;
}

void DepthMapFuser::Rest() {
  past_views_.Clear();
  inferred_.Rest();
  buffers_ = {};
  width_px_ = height_px_ = 0;
}

template <typename Archive>
void DepthMapFuser::Exchange(Archive& archive) {
  archive.Number(merge_radius_px_);
  archive.Number(latest_exposure_.gain);
  archive.Number(latest_exposure_.offset);
  RequireSound(archive,
               std::has_single_bit(merge_radius_px_) && merge_radius_px_ <= kMaxMergeRadius_px);
}

template void DepthMapFuser::Exchange(ByteWriter& archive);
template void DepthMapFuser::Exchange(ByteReader& archive);

}  // namespace mono3d
