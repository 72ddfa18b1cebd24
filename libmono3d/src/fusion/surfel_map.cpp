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
}

}  // namespace

// Paper, section 3.3: registration with the model, then fusion.
FusionResult VulkanSurfelMap::Integrate(const DepthMap& map, const KeyframePoses& poses) {
  const ScopedStageTimer timer(times_, "fusion/integrate");
  RequireUsable(map);
  const KeyframePose& keyframe = poses.At(map.keyframe_id);
  (void)Update(poses);
  if (map_id_ && *map_id_ != keyframe.map_id) {
    return Rejected(keyframe.S_world_kf, "map " + std::to_string(keyframe.map_id) +
                                             " of the tracker has nothing in common with map " +
                                             std::to_string(*map_id_) + " of the model");
  }
  if (num_depth_maps_ + 2 * kDeformationWindow >= kMaxDepthMaps) {
    return Rejected(keyframe.S_world_kf, "model is full: it has the most depth maps it can count");
  }
  PackedDepthMap packed = Pack(map, options_.with_confidence);
  if (packed.num_candidates == 0)
    return Rejected(keyframe.S_world_kf, "no estimate in the depth map");

  Upload({map, keyframe.T_world_cam()}, packed);
  const Placement placement = Place(map, keyframe.S_world_kf);
  const Registration& registration = placement.registration;
  if (!registration.rejection.empty()) {
    FusionResult result = Rejected(keyframe.S_world_kf, registration.rejection);
    result.registration = registration.evidence;
    return result;
  }
  const Similarity& S_world_kf = registration.S_world_kf;
  const PlacedDepthMap placed = Placed(map, S_world_kf);
  if (placement.join) {
    Upload(placed, Pack(placed.map, options_.with_confidence));
  } else {
    buffers_.ScaleDepth(static_cast<float>(S_world_kf.scale()), packed);
  }
  // With all its pixels new, is there room? If not, gaps may be enough; surfels stay what they are.
  if (surfels_.max_size() - surfels_.size() < packed.num_candidates) surfels_.Compact();
  std::uint32_t num_new = Associate(ViewOf(placed), placement.submap);
  while (!MakeRoom(num_new) && Coarsen()) num_new = Associate(ViewOf(placed), placement.submap);
  if (surfels_.max_size() - surfels_.size() < num_new) {
    return Rejected(keyframe.S_world_kf, "model is full: " + std::to_string(num_surfels()) +
                                             " surfels and " + std::to_string(num_new) +
                                             " new ones, room for " +
                                             std::to_string(surfels_.max_size()));
  }
  AddView({map.keyframe_id, map.frame_index, map.timestamp_s, map.camera, keyframe.S_world_kf,
           S_world_kf, MedianDepth(map), placement.submap});
  const std::uint32_t num_removed = ChangeSurfels(ViewOf(placed), num_new);
  past_views_.Push(device_, placed, buffers_);
  surfels_.BeginDepthMap(num_depth_maps_);
  surfels_.Update(num_new, num_removed);
  if (surfels_.num_removed() > surfels_.size() / kMaxRemovedShare) surfels_.Compact();
  map_id_ = keyframe.map_id;
  tracker_drifted_ = registration.evidence.moved;
  ++num_depth_maps_;

  FusionResult result;
  result.status = FusionStatus::kFused;
  result.S_world_kf = S_world_kf;
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

// The map of the tracker in which the keyframes of the model are by `poses`.
std::optional<int> VulkanSurfelMap::MapIdBy(const KeyframePoses& poses) const {
  for (const FusedView& view : views_) {
    const KeyframePose* found = poses.Find(view.keyframe_id);
    if (found != nullptr) return found->map_id;
  }
  return map_id_;
}

UpdateResult VulkanSurfelMap::Update(const KeyframePoses& poses) {
  const ScopedStageTimer timer(times_, "fusion/update");
  UpdateResult result;
  map_id_ = MapIdBy(poses);
  const std::vector<Similarity> motions =
      map_id_ ? MoveViews(views_, poses, *map_id_) : std::vector<Similarity>();
  if (!motions.empty()) {
    result.has_moved = true;
    past_views_.Clear();  // they show the scene as it was
    corrector_.Deform(recorder_, MakeNodes(views_, motions), surfels_, times_);
    surfels_.SetBounded(0);
    result.num_merged = MergeOverlaps(ViewsOfOverlap(views_, motions, kMaxMergingViews));
    if (surfels_.num_removed() > surfels_.size() / kMaxRemovedShare) surfels_.Compact();
  }
  result.num_surfels = num_surfels();
  return result;
}

std::vector<FusedDepthMap> VulkanSurfelMap::DepthMaps() const {
  std::vector<FusedDepthMap> maps;
  for (const FusedView& view : views_) {
    if (view.is_break) continue;
    maps.push_back({view.frame_index, view.timestamp_s, view.keyframe_id, view.S_world_kf});
  }
  std::ranges::stable_sort(maps, {}, &FusedDepthMap::frame_index);
  return maps;
}

void VulkanSurfelMap::TakeOut(std::uint32_t first_depth_map) {
  past_views_.Clear();
  surfels_.RemoveAnchoredFrom(first_depth_map);
  views_.resize(std::min<std::size_t>(views_.size(), first_depth_map));
  while (!views_.empty() && views_.back().is_break) views_.pop_back();
  num_depth_maps_ = static_cast<std::uint32_t>(views_.size());
  tracker_drifted_ = false;
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
  const ViewParams params =
      MakeViewParams(seen, view.S_world_kf.pose(), options_, surfels_.size(), num_depth_maps_);
  FindVisible({&params, 1}, kViewMargin_px);
  const std::uint32_t num_removed =
      corrector_.MergeOverlap(recorder_, stages_, params, buffers_, surfels_, visible_, times_);
  culler_.Bound(recorder_, visible_, surfels_.size(), surfels_);
  surfels_.Update(0, num_removed);
  return num_removed;
}

FusionResult VulkanSurfelMap::Rejected(const Similarity& S_world_kf, std::string reason) const {
  FusionResult result;
  result.reason = std::move(reason);
  result.S_world_kf = S_world_kf;
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

void VulkanSurfelMap::Upload(const PlacedDepthMap& placed, const PackedDepthMap& packed) {
  Resize(placed.map.camera);
  buffers_.Upload(packed);
  stages_.Prepare(recorder_, ViewOf(placed), buffers_);
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
std::uint32_t VulkanSurfelMap::ChangeSurfels(ViewParams params, std::uint32_t num_new) {
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
    ViewParams params = MakeViewParams(past.view.map, past.view.T_world_cam, options_, num_surfels,
                                       num_depth_maps_);
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

ViewParams VulkanSurfelMap::ViewOf(const PlacedDepthMap& placed) const {
  ViewParams params =
      MakeViewParams(placed.map, placed.T_world_cam, options_, surfels_.size(), num_depth_maps_);
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
