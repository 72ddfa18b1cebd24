// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/inferred_fuser.h"

#include <algorithm>
#include <array>
#include <limits>
#include <opencv2/core.hpp>
#include <string>

#include "fusion/coarsen.h"
#include "fusion/selection.h"
#include "fusion/view.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kInferredMargin_px = 1;  // so that no rounding matters at the border

// So that any surfel in a pixel covers it, whatever its depth and normal.
ViewParams AnySurfelCovers(ViewParams params) {
  params.association_sigmas = 1e30F;
  params.min_normal_cosine = -2;
  return params;
}

}  // namespace

void InferredFuser::FindVisible(const View& view) {
  ViewParams params = view.params;
  params.num_surfels = model_.inferred.size();
  const ModelView model_view{params, view.anchors};
  context_.culler.FindVisible(context_.recorder, {&model_view, 1}, kInferredMargin_px,
                              model_.inferred, visible_, context_.times);
  if (model_.anchors.num_submaps() > 1) {
    visible_.Set(context_.device, BlocksOfSubmap(visible_.numbers(), model_.inferred.anchors(),
                                                 model_.anchors, view.submap));
  }
}

void InferredFuser::GiveWay(const View& view) {
  changed_anchors_.clear();
  if (model_.inferred.num_slots() == 0) {
    visible_.Set(context_.device, {});
    return;
  }
  FindVisible(view);
  ViewParams params = view.params;
  params.num_surfels = model_.inferred.size();
  Recorder& recorder = context_.recorder;
  const Buffer& num_removed = view.buffers.num_removed;
  recorder.Fill(num_removed, 0);
  context_.kernels.Associate(recorder, params, view.anchors, view.buffers, model_.inferred,
                             visible_);
  context_.kernels.GiveWay(recorder, params, num_removed, model_.inferred, visible_);
  context_.kernels.ClearFreeSpace(recorder, params, num_removed, model_.inferred, visible_);
  recorder.Submit(context_.times);
  model_.inferred.Remove(num_removed.Download<std::uint32_t>().front());
  for (const std::uint32_t block : visible_.numbers()) {
    const std::uint32_t anchor = model_.inferred.anchors()[block];
    if (changed_anchors_.empty() || changed_anchors_.back() != anchor) {
      changed_anchors_.push_back(anchor);
    }
  }
}

// Returns the number of candidates.
std::int64_t InferredFuser::Write(const DepthMap& map, std::span<const std::uint32_t> colours) {
  const bool is_new = map.camera.width != width_px_ || map.camera.height != height_px_;
  if (is_new) {
    // Where there is no memory for them, the size stays that of the old ones.
    buffers_ = DepthMapBuffers(context_.device, map.camera.width, map.camera.height);
    width_px_ = map.camera.width;
    height_px_ = map.camera.height;
    pixels_.clear();
  }
  return buffers_.Write(context_.device, [&](const PackedPixels& to) {
    if (is_new) {
      std::ranges::fill(to.depth, 0.0F);
      std::ranges::fill(to.normal_confidence, std::array<float, 4>{});
    }
    return PackInferred(map, context_.options.with_confidence, colours, to, pixels_);
  });
}

std::int64_t InferredFuser::Fuse(const View& view, const DepthMap& map,
                                 std::span<const std::uint32_t> colours, PastViews& past) {
  if (map.inferred.empty() || cv::countNonZero(map.inferred) == 0) return 0;
  if (Write(map, colours) == 0) return 0;
  context_.kernels.Prepare(context_.recorder, view.params, buffers_);
  const std::vector<std::uint32_t> new_pixels = SelectUncovered(view);
  const auto num_new = static_cast<std::uint32_t>(new_pixels.size());
  SurfelStorage& surfels = model_.inferred;
  if (!surfels.MakeRoom(WholeBlocks(num_new))) return 0;
  buffers_.new_pixels.Upload(std::span(new_pixels));
  added_.Set(context_.device, surfels.BeginInsert(view.number, num_new));

  ViewParams params = view.params;
  params.num_surfels = surfels.size();
  params.map_index = view.number;
  params.num_new = num_new;
  Recorder& recorder = context_.recorder;
  const FusionKernels& kernels = context_.kernels;
  recorder.Fill(buffers_.num_removed, 0);
  kernels.Merge(recorder, params, view.anchors, buffers_, buffers_.num_removed, surfels, visible_);
  context_.culler.Bound(recorder, visible_, params.num_surfels, surfels);
  kernels.Insert(recorder, params, buffers_, surfels, added_);
  Review(params, SpheresOfNew(params, new_pixels, buffers_.depths()), past);
  recorder.Submit(context_.times);
  std::int64_t num_confirmed = 0;
  for (const auto& confirmed : surfels.TakeConfirmed(visible_.numbers())) {
    num_confirmed += confirmed.num_surfels;
  }
  surfels.EndInsert(num_new, buffers_.num_removed.Download<std::uint32_t>().front());
  return num_new + num_confirmed;
}

// Pixels with an inferred depth in which the model shows nothing that was matched, whatever its
// depth, and nothing inferred of the same surface. What the depth map says of the inferred surfels
// is in their association afterwards.
std::vector<std::uint32_t> InferredFuser::SelectUncovered(const View& view) {
  Recorder& recorder = context_.recorder;
  const FusionKernels& kernels = context_.kernels;
  // The index map is as the fused depth map found the model: since then surfels have moved along
  // the rays of this view, and those removed had no inferred pixel beside them.
  const ViewParams any = AnySurfelCovers(view.params);
  kernels.SelectNew(recorder, any, view.anchors, buffers_, view.buffers.index_map, model_.surfels,
                    view.visible);
  recorder.Submit(context_.times);
  std::vector<std::uint32_t> selected = buffers_.selected.Download<std::uint32_t>();

  ViewParams params = view.params;
  params.num_surfels = model_.inferred.size();
  // From here on the index map is that of the inferred surfels.
  kernels.AssociateAndDraw(recorder, params, view.anchors, buffers_, view.buffers.index_map,
                           model_.inferred, visible_);
  kernels.SelectNew(recorder, params, view.anchors, buffers_, view.buffers.index_map,
                    model_.inferred, visible_);
  recorder.Submit(context_.times);
  const std::vector<std::uint32_t> uncovered = buffers_.selected.Download<std::uint32_t>();
  for (std::size_t i = 0; i < selected.size(); ++i) selected[i] &= uncovered[i];
  if (params.merge_radius_px > 1) {
    KeepEveryPixel(params.merge_radius_px, params.width_px, selected);
  }
  return ListSelected(selected);
}

// What the depth maps before this one say of its new surfels.
void InferredFuser::Review(const ViewParams& of_map, std::span<const BlockSphere> spheres,
                           PastViews& past) {
  if (of_map.num_new == 0) return;
  for (PastView& view : past.views()) {
    ViewParams params =
        MakeViewParams(view.map, context_.options, of_map.num_surfels, of_map.map_index);
    params.is_past = 1;
    view.LookAt(context_.device, params, model_.anchors, of_map.map_index, added_.numbers(),
                spheres);
    context_.kernels.Associate(context_.recorder, params, view.anchors, view.buffers,
                               model_.inferred, view.new_blocks);
    context_.kernels.ClearFreeSpace(context_.recorder, params, buffers_.num_removed,
                                    model_.inferred, view.new_blocks);
  }
}

void InferredFuser::Rest() {
  buffers_ = {};
  pixels_.clear();
  width_px_ = height_px_ = 0;
}

}  // namespace mono3d
