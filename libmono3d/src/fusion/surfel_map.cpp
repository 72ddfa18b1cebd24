// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "fusion/export.h"
#include "fusion/registration/problem.h"
#include "fusion/vulkan_surfel_map.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

void RequireUsable(const DepthMap& map) {
  Validate(map);
  if (map.camera.HasDistortion()) {
    throw Error(ErrorParts{.what = "camera with distortion",
                           .where = "depth map",
                           .expected = "an undistorted depth map",
                           .found = {}});
  }
}

// Of what may be on the device: of the surfels that were matched. Over a forest there are as many
// others between them.
constexpr double kShareOfMatched = 0.5;

SurfelStorage StorageFor(FusionContext& context, double share) {
  const SurfelMapOptions& options = context.options;
  return {context.device, static_cast<std::uint32_t>(options.max_surfels),
          Residency{MaxSurfelsOnDevice(*context.device, options.storage, share), &context.depot}};
}

// The surfels of another model, with their anchors numbered from `first_anchor` on: behind those
// of this one.
void TakeOver(const SurfelStorage& from, std::uint32_t first_anchor, SurfelStorage& to) {
  const std::uint32_t in_both_halves = first_anchor << 16U | first_anchor;
  from.ForEachAnchor([&](std::uint32_t anchor, const Surfels& with_gaps) {
    Surfels surfels = InWholeBlocks(with_gaps);
    for (Surfels::Uint4& history : surfels.history) {
      history[2] += in_both_halves;
      history[3] += first_anchor;
    }
    to.Add(first_anchor + anchor, std::move(surfels));
  });
}

Anchor AnchorOfMap(const DepthMap& map, const KeyframePoses& poses) {
  Anchor anchor;
  anchor.keyframe_id = map.keyframe_id;
  anchor.frame_index = map.frame_index;
  anchor.timestamp_s = map.timestamp_s;
  anchor.camera = map.camera;
  anchor.median_depth_su = MedianDepth(map);
  anchor.depth_scale = DepthScale(map, anchor.median_depth_su);
  anchor.S_tracker_kf = TrackedPose(poses, poses.At(map.keyframe_id).map_id, anchor).value();
  return anchor;
}

}  // namespace

VulkanSurfelMap::VulkanSurfelMap(std::shared_ptr<Device> device, const SurfelMapOptions& options,
                                 StageTimes* times)
    : context_(std::move(device), options, times),
      model_{StorageFor(context_, kShareOfMatched), {}, StorageFor(context_, 1 - kShareOfMatched)},
      merger_(context_, model_),
      placer_(context_, model_, merger_),
      fuser_(context_, model_) {}

FusionResult VulkanSurfelMap::Integrate(const DepthMap& map, const KeyframePoses& poses) {
  const ScopedStageTimer timer(context_.times, "fusion/integrate");
  RequireUsable(map);
  // Later depth maps are registered with the surfels of this one: what is inferred would draw them
  // to surfaces that nobody has seen. It is fused apart.
  const DepthMap matched = WithoutInferred(map);
  DepthMap corrected = matched;
  corrected.bgr = vignetting_.Corrected(map.bgr, map.camera);
  FusionResult result = IntegrateCorrected(corrected, map, poses);
  if (result.status == FusionStatus::kFused) vignetting_.Add(matched, result.S_world_kf);
  return result;
}

// Paper, section 3.3: registration with the model, then fusion.
FusionResult VulkanSurfelMap::IntegrateCorrected(const DepthMap& map, const DepthMap& whole,
                                                 const KeyframePoses& poses) {
  const KeyframePose& keyframe = poses.At(map.keyframe_id);
  (void)Update(poses);
  if (map_id_ && *map_id_ != keyframe.map_id) {
    return Rejected(keyframe.S_world_kf, FusionRejection::kOtherMap,
                    "map " + std::to_string(keyframe.map_id) +
                        " of the tracker has nothing in common with map " +
                        std::to_string(*map_id_) + " of the model");
  }
  if (model_.anchors.size() >= kMaxDepthMaps) {
    return Rejected(keyframe.S_world_kf, FusionRejection::kModelFull,
                    "model is full: it has the most depth maps it can count");
  }
  if (!fuser_.Upload(map)) {
    return Rejected(keyframe.S_world_kf, FusionRejection::kNoEstimate,
                    "no estimate in the depth map");
  }

  const Anchor anchor = AnchorOfMap(map, poses);
  const Similarity& S_tracker_kf = anchor.S_tracker_kf;
  (void)merger_.MergeNearest({anchor, S_tracker_kf});
  CloseGaps();
  std::uint32_t radius_px = fuser_.merge_radius_px();
  std::optional<Placement> placed;
  (void)fuser_.Look([&] { placed = placer_.Place(map, anchor, fuser_.buffers()); });
  changes_.Changed(merger_.TakeChangedAnchors());
  if (radius_px != fuser_.merge_radius_px()) changes_.AllChanged(model_.anchors.size());
  if (!placed) {
    return Rejected(S_tracker_kf, FusionRejection::kModelFull,
                    "model is full: the device has no room for what the depth map shows of it");
  }
  const Placement& placement = *placed;
  const Registration& registration = placement.registration;
  if (!registration.rejection.empty()) {
    FusionResult result =
        Rejected(S_tracker_kf, FusionRejection::kNotRegistered, registration.rejection);
    result.registration = registration.evidence;
    return result;
  }
  radius_px = fuser_.merge_radius_px();
  DepthMap weighed = map;
  weighed.depth_sigma_per_square_depth *= registration.evidence.noise;
  const auto counts =
      fuser_.Fuse(weighed, whole, anchor, registration.S_world_kf, placement.submap);
  if (radius_px != fuser_.merge_radius_px()) changes_.AllChanged(model_.anchors.size());
  if (!counts) {
    return Rejected(S_tracker_kf, FusionRejection::kModelFull,
                    "model is full: " + std::to_string(num_surfels()) + " surfels and " +
                        std::to_string(fuser_.num_wanted()) + " new ones, room for " +
                        std::to_string(model_.surfels.max_slots()));
  }
  merger_.AnchorAdded();
  std::vector<std::uint32_t> changed = fuser_.changed_anchors();
  changed.push_back(model_.anchors.size() - 1);
  changes_.Changed(changed);
  CloseGaps();
  map_id_ = keyframe.map_id;
  placer_.SetTrackerDrifted(registration.evidence.moved);

  FusionResult result;
  result.status = FusionStatus::kFused;
  result.S_world_kf = registration.S_world_kf;
  result.registration = registration.evidence;
  result.num_merged = counts->num_merged;
  result.num_inserted = counts->num_inserted;
  result.num_removed = counts->num_removed;
  result.num_inferred = counts->num_inferred;
  result.exposure_gain = counts->exposure.gain;
  result.exposure_offset = counts->exposure.offset;
  result.num_surfels = num_surfels();
  result.starts_submap = placement.starts_submap;
  if (placement.join) result.submap_joins.push_back(*placement.join);
  result.constraints = placement.constraints;
  return result;
}

// A new table of poses: the surfels follow where they are looked at. What comes to lie upon each
// other is merged later.
UpdateResult VulkanSurfelMap::Update(const KeyframePoses& poses) {
  const ScopedStageTimer timer(context_.times, "fusion/update");
  UpdateResult result;
  if (const auto map_id = model_.anchors.MapIdBy(poses)) map_id_ = map_id;
  if (map_id_) result.has_moved = model_.anchors.Update(poses, *map_id_);
  if (result.has_moved) merger_.AnchorsMoved();
  result.num_surfels = num_surfels();
  return result;
}

std::vector<FusedDepthMap> VulkanSurfelMap::DepthMaps() const {
  std::vector<FusedDepthMap> maps;
  for (std::uint32_t i = 0; i < model_.anchors.size(); ++i) {
    const Anchor& anchor = model_.anchors.anchor(i);
    maps.push_back({anchor.frame_index, anchor.timestamp_s, anchor.keyframe_id,
                    model_.anchors.S_world_kf()[i]});
  }
  std::ranges::stable_sort(maps, {}, &FusedDepthMap::frame_index);
  return maps;
}

SurfelChanges VulkanSurfelMap::ChangesSince(std::uint64_t version) {
  return changes_.Since(version, model_);
}

ChosenSurfels VulkanSurfelMap::Choose(const SurfelExportOptions& options) const {
  const std::span<const Similarity> S_world_anchor = model_.anchors.S_world_surfels();
  const auto parts_of = [](const SurfelStorage& storage) {
    const auto for_each = [&](const std::function<void(const Surfels&)>& take) {
      storage.ForEachAnchor([&](std::uint32_t, const Surfels& surfels) { take(surfels); });
    };
    return SurfelParts{for_each, storage.num_surfels()};
  };
  return mono3d::Choose(parts_of(model_.surfels), parts_of(model_.inferred), S_world_anchor,
                        model_.anchors.Frames(), options);
}

void VulkanSurfelMap::TakeOut(std::uint32_t first_depth_map) {
  fuser_.ForgetPastViews();
  vignetting_.ForgetViews();
  model_.surfels.RemoveAnchoredFrom(first_depth_map);
  model_.inferred.RemoveAnchoredFrom(first_depth_map);
  model_.anchors.RemoveFrom(first_depth_map);
  merger_.AnchorsRemovedFrom(first_depth_map);
  changes_.AllChanged(model_.anchors.size());
  placer_.SetTrackerDrifted(false);
}

void VulkanSurfelMap::Rest() {
  fuser_.Rest();
  vignetting_.ForgetViews();
}

void VulkanSurfelMap::MergePending() {
  if (merger_.MergePending() == 0) return;
  changes_.Changed(merger_.TakeChangedAnchors());
  CloseGaps();
}

SurfelMapParts VulkanSurfelMap::Parts() {
  return {context_, model_, merger_, placer_, fuser_, changes_, vignetting_, map_id_};
}

void VulkanSurfelMap::SaveState(StateFolder& folder, const std::string& name) {
  const ScopedStageTimer timer(context_.times, "fusion/save");
  state_.Save(Parts(), folder, name);
}

void VulkanSurfelMap::RestoreState(const StateFolder& folder, const std::string& name) {
  state_.Restore(Parts(), folder, name);
}

FusionResult VulkanSurfelMap::Rejected(const Similarity& S_world_kf, FusionRejection rejection,
                                       std::string reason) const {
  FusionResult result;
  result.rejection = rejection;
  result.reason = std::move(reason);
  result.S_world_kf = S_world_kf;
  result.num_surfels = num_surfels();
  return result;
}

void VulkanSurfelMap::CloseGaps() {
  model_.surfels.CloseGaps();
  model_.inferred.CloseGaps();
}

std::optional<UpdateResult> VulkanSurfelMap::Join(SurfelMap& other, const KeyframePoses& poses) {
  auto* theirs = dynamic_cast<VulkanSurfelMap*>(&other);
  if (theirs == nullptr || theirs == this) return std::nullopt;
  const auto map_id = theirs->model_.anchors.MapIdBy(poses);
  const auto own_map_id = model_.anchors.MapIdBy(poses);
  if (map_id && own_map_id && map_id != own_map_id) return std::nullopt;
  const SurfelStorage& own = model_.surfels;
  const std::uint32_t num_anchors = model_.anchors.size() + theirs->model_.anchors.size();
  if (num_anchors >= kMaxDepthMaps ||
      own.max_slots() - own.num_slots() < theirs->model_.surfels.num_slots()) {
    return std::nullopt;
  }
  const std::int64_t num_before = num_surfels() + theirs->num_surfels();
  UpdateResult result = Update(poses);
  result.has_moved = theirs->Update(poses).has_moved || result.has_moved;
  MergePending();
  theirs->MergePending();
  if (map_id) map_id_ = map_id;
  if (!theirs->model_.anchors.empty()) Append(*theirs);
  result.num_surfels = num_surfels();
  result.num_merged = num_before - result.num_surfels;
  return result;
}

// Makes another model in the same world, which is empty afterwards, a part of this one. Its submaps
// are further ones; but where as much of them lies upon this one as a depth map would have to show,
// within the noise of both, two become one. Returns the number of surfels that were merged.
std::int64_t VulkanSurfelMap::Append(VulkanSurfelMap& other) {
  AnchorMap& anchors = model_.anchors;
  const std::uint32_t first_anchor = anchors.size();
  const bool was_one_submap = anchors.num_submaps() == 1 && other.num_submaps() == 1;
  TakeOver(other.model_.surfels, first_anchor, model_.surfels);
  const SurfelStorage& inferred = model_.inferred;
  if (inferred.max_slots() - inferred.num_slots() >= other.model_.inferred.num_slots()) {
    TakeOver(other.model_.inferred, first_anchor, model_.inferred);
  }
  anchors.Append(std::exchange(other.model_.anchors, {}));
  placer_.SetTrackerDrifted(other.placer_.tracker_drifted());
  fuser_.SetMergeRadius(std::max(fuser_.merge_radius_px(), other.fuser_.merge_radius_px()));
  fuser_.ForgetPastViews();
  vignetting_.ForgetViews();
  std::vector<bool> is_other(anchors.size());
  std::fill(is_other.begin() + first_anchor, is_other.end(), true);

  other.model_.surfels.Upload({});
  other.model_.inferred.Upload({});
  other.merger_.AnchorsRemovedFrom(0);
  other.changes_.AllChanged(0);
  other.map_id_.reset();
  other.Rest();
  const std::int64_t num_merged = merger_.MergeAcross(is_other);
  (void)merger_.TakeChangedAnchors();
  model_.surfels.CloseGaps();
  changes_.AllChanged(anchors.size());
  const CameraModel& camera = anchors.back().camera;
  const double needed = context_.options.gate.min_overlap * camera.width * camera.height;
  if (was_one_submap && static_cast<double>(num_merged) >= needed) {
    anchors.JoinSubmaps(anchors.SubmapOf(0), anchors.SubmapOfLatest());
  }
  return num_merged;
}

std::unique_ptr<SurfelMap> CreateSurfelMap(std::shared_ptr<Device> device,
                                           const SurfelMapOptions& options, StageTimes* times) {
  options.Validate();
  return std::make_unique<RepairingSurfelMap>(
      std::make_unique<VulkanSurfelMap>(std::move(device), options, times), options);
}

}  // namespace mono3d
