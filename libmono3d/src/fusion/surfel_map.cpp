// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/surfel_map.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "fusion/coarsen.h"
#include "fusion/registration_gate.h"
#include "fusion/view.h"
#include "fusion/vulkan_surfel_map.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Gaps cost time in every stage over the surfels; one slot in four is worth a copy of the model.
constexpr std::uint32_t kMaxRemovedShare = 4;
// After a correction, views from which overlapping parts are merged.
constexpr std::size_t kMaxMergingViews = 6;

// A 64th of the surfels; coarser is not worth having.
constexpr std::uint32_t kMaxMergeRadius_px = 8;

void RequireUsable(const DepthMap& map) {
  Validate(map);
  if (map.camera.HasDistortion()) {
    throw Error(ErrorParts{.what = "camera with distortion",
                           .where = "depth map",
                           .expected = "an undistorted depth map",
                           .found = {}});
  }
  if (!map.T_world_cam.Matrix().allFinite()) {
    throw Error(ErrorParts{
        .what = "pose is not finite", .where = "depth map", .expected = {}, .found = {}});
  }
}

}  // namespace

// Paper, section 3.3: registration with the model, then fusion.
FusionResult VulkanSurfelMap::Integrate(const DepthMap& map) {
  const ScopedStageTimer timer(times_, "fusion/integrate");
  RequireUsable(map);
  if (map_id_ && *map_id_ != map.map_id) {
    return Rejected(map, "map " + std::to_string(map.map_id) +
                             " of the tracker has nothing in common with map " +
                             std::to_string(*map_id_) + " of the model");
  }
  if (num_depth_maps_ + 2 * kDeformationWindow >= kMaxDepthMaps)
    return Rejected(map, "model is full: it has the most depth maps it can count");
  PackedDepthMap packed = Pack(map, options_.with_confidence);
  if (packed.num_candidates == 0) return Rejected(map, "no estimate in the depth map");

  Upload(map, packed);
  const Placement placement = Place(map);
  const Registration& registration = placement.registration;
  if (!registration.rejection.empty()) {
    FusionResult result = Rejected(map, registration.rejection);
    result.registration = registration.evidence;
    return result;
  }
  const DepthMap placed = Placed(map, registration.view);
  if (placement.join) {
    Upload(placed, Pack(placed, options_.with_confidence));
  } else {
    buffers_.ScaleDepth(static_cast<float>(registration.view.depth_scale), packed);
  }
  // With all its pixels new, is there room? If not, gaps may be enough; surfels stay what they are.
  if (surfels_.max_size() - surfels_.size() < packed.num_candidates) surfels_.Compact();
  std::uint32_t num_new = Associate(ViewOf(placed), placement.submap);
  while (!MakeRoom(num_new) && Coarsen()) num_new = Associate(ViewOf(placed), placement.submap);
  if (surfels_.max_size() - surfels_.size() < num_new) {
    return Rejected(map, "model is full: " + std::to_string(num_surfels()) + " surfels and " +
                             std::to_string(num_new) + " new ones, room for " +
                             std::to_string(surfels_.max_size()));
  }
  AddView({map.keyframe_id, map.frame_index, map.camera, map.T_world_cam,
           ScaleOfKeyframe(map.keyframe_id), placed.T_world_cam,
           ScaleOfKeyframe(map.keyframe_id) * registration.view.depth_scale, MedianDepth(placed),
           placement.submap});
  const std::uint32_t num_removed = Update(ViewOf(placed), num_new);
  past_views_.Push(device_, placed, buffers_);
  surfels_.BeginDepthMap(num_depth_maps_);
  surfels_.Update(num_new, num_removed);
  if (surfels_.num_removed() > surfels_.size() / kMaxRemovedShare) surfels_.Compact();
  map_id_ = map.map_id;
  tracker_is_astray_ = registration.evidence.moved;
  ++num_depth_maps_;

  FusionResult result;
  result.status = FusionStatus::kFused;
  result.T_world_cam = placed.T_world_cam;
  result.scale = registration.view.depth_scale;
  result.registration = registration.evidence;
  result.num_merged = packed.num_candidates - num_new;
  result.num_inserted = num_new;
  result.num_removed = num_removed;
  result.num_surfels = num_surfels();
  result.starts_submap = placement.starts_submap;
  if (placement.join) result.submap_joins.push_back(*placement.join);
  result.constraints = placement.constraints;
  return result;
}

CorrectionResult VulkanSurfelMap::Correct(std::span<const KeyframeCorrection> corrections) {
  const ScopedStageTimer timer(times_, "fusion/correct");
  std::vector<KeyframeCorrection> own;
  std::copy_if(corrections.begin(), corrections.end(), std::back_inserter(own),
               [&](const KeyframeCorrection& c) { return c.map_id == map_id_; });
  for (const KeyframeCorrection& c : own) scale_of_keyframe_[c.id] = c.scale;
  CorrectionResult result;
  const std::vector<Similarity> motions = MoveViews(views_, own);
  if (!motions.empty()) {
    past_views_.Clear();  // they show the scene as it was
    corrector_.Deform(recorder_, MakeNodes(views_, motions), surfels_, times_);
    surfels_.SetBounded(0);
    result.num_merged = MergeOverlaps(ViewsOfOverlap(views_, motions, kMaxMergingViews));
    if (surfels_.num_removed() > surfels_.size() / kMaxRemovedShare) surfels_.Compact();
    result.views = MovedViews();
  }
  result.num_surfels = num_surfels();
  return result;
}

void VulkanSurfelMap::TakeOut(std::uint32_t first_depth_map) {
  past_views_.Clear();
  surfels_.RemoveAnchoredFrom(first_depth_map);
  views_.resize(std::min<std::size_t>(views_.size(), first_depth_map));
  while (!views_.empty() && views_.back().is_break) views_.pop_back();
  num_depth_maps_ = static_cast<std::uint32_t>(views_.size());
  tracker_is_astray_ = false;
}

// What these views show twice. Without memory for it things stay double.
std::int64_t VulkanSurfelMap::MergeOverlaps(std::span<const std::size_t> views) {
  std::int64_t num_merged = 0;
  try {
    for (const std::size_t view : views) num_merged += MergeOverlap(views_[view]);
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string("overlapping parts are not merged: ") + error.what());
  }
  corrector_.EndMerging();
  return num_merged;
}

std::uint32_t VulkanSurfelMap::MergeOverlap(const FusedView& view) {
  Resize(view.camera);
  DepthMap seen;  // its images play no part
  seen.camera = view.camera;
  seen.T_world_cam = view.T_world_cam;
  const ViewParams params = MakeViewParams(seen, options_, surfels_.size(), num_depth_maps_);
  FindVisible({&params, 1}, kViewMargin_px);
  const std::uint32_t num_removed =
      corrector_.MergeOverlap(recorder_, stages_, params, buffers_, surfels_, visible_, times_);
  culler_.Bound(recorder_, visible_, surfels_.size(), surfels_);
  surfels_.Update(0, num_removed);
  return num_removed;
}

FusionResult VulkanSurfelMap::Rejected(const DepthMap& map, std::string reason) const {
  FusionResult result;
  result.reason = std::move(reason);
  result.T_world_cam = map.T_world_cam;
  result.num_surfels = num_surfels();
  return result;
}

void VulkanSurfelMap::Resize(const CameraModel& camera) {
  if (camera.width == width_px_ && camera.height == height_px_) return;
  buffers_ = DepthMapBuffers(device_, camera.width, camera.height);
  width_px_ = camera.width;
  height_px_ = camera.height;
}

void VulkanSurfelMap::FindVisible(std::span<const ViewParams> views, std::uint32_t margin_px) {
  culler_.FindVisible(recorder_, views, margin_px, surfels_, visible_, times_);
}

void VulkanSurfelMap::Upload(const DepthMap& map, const PackedDepthMap& packed) {
  Resize(map.camera);
  buffers_.Upload(packed);
  stages_.Prepare(recorder_, ViewOf(map), buffers_);
}

// What the depth map says of each surfel, and which of its pixels are new: returns how many, and
// leaves them in buffers_.new_pixels. Leaves the model alone.
// Of the surfels those of one submap: another one may be off, and must not be drawn to it.
std::uint32_t VulkanSurfelMap::Associate(const ViewParams& params, int submap) {
  FindVisible({&params, 1}, kViewMargin_px);
  if (num_submaps() > 1) {
    visible_.Set(device_,
                 BlocksOfSubmap(visible_.numbers(), views_, surfels_.first_slots(), submap));
  }
  stages_.Associate(recorder_, params, buffers_, surfels_, visible_);
  stages_.DrawIndexMap(recorder_, params, buffers_, surfels_, visible_);
  stages_.SelectNew(recorder_, params, buffers_, surfels_);
  recorder_.Submit(times_);
  std::vector<std::uint32_t> selected = buffers_.selected.Download<std::uint32_t>();
  if (merge_radius_px_ > 1) KeepEveryPixel(merge_radius_px_, params.width_px, selected);
  const std::vector<std::uint32_t> new_pixels = ListSelected(selected);
  buffers_.new_pixels.Upload(std::span(new_pixels));
  return static_cast<std::uint32_t>(new_pixels.size());
}

// Returns the number of surfels removed.
std::uint32_t VulkanSurfelMap::Update(ViewParams params, std::uint32_t num_new) {
  params.num_new = num_new;
  stages_.Merge(recorder_, params, buffers_, surfels_, visible_);
  recorder_.Fill(buffers_.num_removed, 0);
  stages_.ClearFreeSpace(recorder_, params, buffers_.num_removed, surfels_, visible_);
  culler_.Bound(recorder_, visible_, params.num_surfels, surfels_);
  stages_.Insert(recorder_, params, buffers_, surfels_);
  ReviewNew(params.num_surfels, params.num_surfels + num_new);
  recorder_.Submit(times_);
  return buffers_.num_removed.Download<std::uint32_t>().front();
}

// What the depth maps before this one say of its new surfels: they cannot confirm them, or there
// would be a surfel there already, but they may have seen through them, or something before them.
void VulkanSurfelMap::ReviewNew(std::uint32_t first_surfel, std::uint32_t num_surfels) {
  if (first_surfel == num_surfels) return;
  latest_.SetRange(device_, first_surfel, num_surfels);
  for (const PastView& past : past_views_.views()) {
    ViewParams params = MakeViewParams(past.view, options_, num_surfels, num_depth_maps_);
    params.first_surfel = first_surfel;
    params.is_past = 1;
    stages_.Associate(recorder_, params, past.buffers, surfels_, latest_);
    stages_.ClearFreeSpace(recorder_, params, buffers_.num_removed, surfels_, latest_);
  }
}

bool VulkanSurfelMap::MakeRoom(std::uint32_t num_new) {
  if (surfels_.max_size() - surfels_.size() < num_new) return false;
  try {
    surfels_.Reserve(recorder_, surfels_.size() + num_new);
  } catch (const Error& error) {  // the device has no more memory
    Log(LogLevel::kWarning, std::string("the model cannot grow: ") + error.what());
    surfels_.StopGrowing();
    return surfels_.max_size() - surfels_.size() >= num_new;
  }
  return true;
}

// Fewer surfels, further apart, from now on. False when they are as far apart as they may be.
bool VulkanSurfelMap::Coarsen() {
  if (merge_radius_px_ >= kMaxMergeRadius_px) return false;
  merge_radius_px_ *= 2;
  const std::int64_t before = num_surfels();
  surfels_.Upload(Coarsened(surfels_.Download()));
  Log(LogLevel::kWarning, "the model is full with " + std::to_string(before) +
                              " surfels: made coarser, " + std::to_string(num_surfels()) +
                              " remain, new ones are " + std::to_string(merge_radius_px_) +
                              " px apart");
  return true;
}

ViewParams VulkanSurfelMap::ViewOf(const DepthMap& placed) const {
  ViewParams params = MakeViewParams(placed, options_, surfels_.size(), num_depth_maps_);
  params.merge_radius_px = merge_radius_px_;
  return params;
}

std::unique_ptr<SurfelMap> CreateSurfelMap(std::shared_ptr<Device> device,
                                           const SurfelMapOptions& options, StageTimes* times) {
  options.Validate();
  return std::make_unique<RepairingSurfelMap>(
      std::make_unique<VulkanSurfelMap>(std::move(device), options, times), options);
}

}  // namespace mono3d
