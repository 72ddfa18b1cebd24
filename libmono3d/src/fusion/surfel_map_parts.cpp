// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The part of VulkanSurfelMap that is about where a depth map goes, and about submaps of the model
// that become one.

#include <algorithm>
#include <cmath>
#include <iterator>

#include "fusion/registration_constraint.h"
#include "fusion/registration_gate.h"
#include "fusion/vulkan_surfel_map.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Views from which submaps are merged that have become one: more than after a closed loop, for two
// submaps may lie upon each other all over.
constexpr std::size_t kMaxViewsOfJoin = 24;

// From where a depth map lies in one submap to where it lies in another.
Similarity Between(const RegisteredView& from, const RegisteredView& to) {
  return Similarity(to.depth_scale, to.T_world_cam) *
         Similarity(from.depth_scale, from.T_world_cam).Inverse();
}

}  // namespace

// The tracker's pose; and that pose moved as the last registration moved the one before it, for a
// tracker that has gone astray knows how the camera has moved since then.
Predictions VulkanSurfelMap::Predict(const DepthMap& map) const {
  Predictions predictions = {{map.T_world_cam, 1}};
  if (tracker_is_astray_) {
    const Similarity S_model_tracker = ModelFromTracker(views_.back());
    predictions.push_back({S_model_tracker * map.T_world_cam, S_model_tracker.scale()});
  }
  return predictions;
}

// Registered with the submaps that it shows. Where it is sure of two, they become one first; where
// it shows none, it is the first of a new one.
VulkanSurfelMap::Placement VulkanSurfelMap::Place(const DepthMap& map) {
  const Predictions predictions = Predict(map);
  if (views_.empty() || !options_.registration.enabled)
    return {.registration = {.view = predictions.front(),
                             .evidence = {},
                             .rejection = {},
                             .information = {},
                             .constraint = {}},
            .submap = 0,
            .starts_submap = false,
            .join = {},
            .constraints = {}};
  std::vector<ViewParams> views;
  for (const RegisteredView& predicted : predictions) {
    views.push_back(ViewOf(Placed(map, predicted)));
  }
  FindVisible(views, static_cast<std::uint32_t>(std::ceil(options_.gate.max_deviation_px)));
  Placement placement;
  placement.submap = views_.back().submap;
  std::vector<SubmapRegistration> shown = RegisterWithSubmaps(map, predictions);
  if (shown.size() > 1) placement.join = JoinSubmaps(map, shown, placement.constraints);
  if (!shown.empty()) {
    placement.submap = shown.front().submap;
    placement.registration = shown.front().registration;
  } else {
    placement.registration = Register(map, predictions, visible_);
  }
  if (!placement.join && placement.registration.constraint) {
    placement.constraints = {*placement.registration.constraint};
  }
  if (!placement.registration.evidence.registered && placement.registration.rejection.empty()) {
    placement.starts_submap = true;
    placement.submap = Submaps(views_).back() + 1;
  }
  return placement;
}

Registration VulkanSurfelMap::Register(const DepthMap& map, const Predictions& predictions,
                                       const BlockList& blocks) {
  Registration registration = registrar_.Register(recorder_, map, buffers_, surfels_, blocks,
                                                  predictions, options_, times_);
  Log(LogLevel::kDebug, "depth map of frame " + std::to_string(map.frame_index) + ": " +
                            Describe(registration.evidence));
  if (!registration.evidence.moved || !registration.rejection.empty()) return registration;
  const std::optional<std::size_t> anchor =
      AnchorOf(blocks.numbers(), views_, surfels_.first_slots());
  if (anchor && views_[*anchor].keyframe_id != map.keyframe_id) {
    registration.constraint =
        MakeConstraint(map.keyframe_id, ScaleOfKeyframe(map.keyframe_id), registration.view,
                       registration.information, views_[*anchor]);
  }
  return registration;
}

// With each that it shows: those first that take it, and of these the one that it shows most of.
// Empty where the model is of one submap alone.
std::vector<VulkanSurfelMap::SubmapRegistration> VulkanSurfelMap::RegisterWithSubmaps(
    const DepthMap& map, const Predictions& predictions) {
  std::vector<SubmapRegistration> shown;
  const std::vector<int> submaps = Submaps(views_);
  if (submaps.size() < 2) return shown;
  for (const int submap : submaps) {
    of_submap_.Set(device_,
                   BlocksOfSubmap(visible_.numbers(), views_, surfels_.first_slots(), submap));
    if (of_submap_.size() == 0) continue;
    Registration registration = Register(map, predictions, of_submap_);
    if (registration.evidence.registered) shown.push_back({submap, std::move(registration)});
  }
  std::stable_sort(shown.begin(), shown.end(), [](const auto& a, const auto& b) {
    const bool is_a_fit = a.registration.rejection.empty();
    if (is_a_fit != b.registration.rejection.empty()) return is_a_fit;
    return a.registration.evidence.overlap > b.registration.evidence.overlap;
  });
  return shown;
}

// Where two submaps at least are sure of the depth map: the others move to the oldest of them, with
// which the depth map is registered then; `shown` is that alone afterwards.
// Those that the tracker has elsewhere are added to `constraints`.
std::optional<SubmapJoin> VulkanSurfelMap::JoinSubmaps(
    const DepthMap& map, std::vector<SubmapRegistration>& shown,
    std::vector<KeyframeConstraint>& constraints) {
  std::vector<SubmapRegistration> sure;
  std::copy_if(shown.begin(), shown.end(), std::back_inserter(sure), [&](const auto& of) {
    const RegistrationEvidence& evidence = of.registration.evidence;
    return of.registration.rejection.empty() &&
           (!evidence.moved || evidence.uncertainty_px <= options_.gate.max_join_uncertainty_px);
  });
  if (sure.size() < 2) return std::nullopt;
  for (const SubmapRegistration& of : sure) {
    if (of.registration.constraint) constraints.push_back(*of.registration.constraint);
  }
  std::sort(sure.begin(), sure.end(),
            [](const auto& a, const auto& b) { return a.submap < b.submap; });
  const SubmapRegistration& oldest = sure.front();
  SubmapJoin join;
  join.frame_index = map.frame_index;
  join.num_submaps = static_cast<int>(sure.size()) - 1;
  std::vector<bool> is_other(views_.size());
  bool is_moved = false;
  for (auto other = sure.begin() + 1; other != sure.end(); ++other) {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      is_other[i] = is_other[i] || views_[i].submap == other->submap;
    }
    if (oldest.registration.evidence.moved || other->registration.evidence.moved) {
      is_moved = true;
      MoveToOldest(map, *other, oldest, join);
    }
    for (FusedView& view : views_)
      view.submap = view.submap == other->submap ? oldest.submap : view.submap;
  }
  if (is_moved) {
    past_views_.Clear();
    surfels_.SetBounded(0);
    join.num_merged = MergeAcross(is_other);
    join.views = MovedViews();
  }
  shown = {oldest};
  Log(LogLevel::kInfo, "depth map of frame " + std::to_string(map.frame_index) + ": joins " +
                           std::to_string(join.num_submaps) + " submap(s) of the model, " +
                           std::to_string(join.moved_px) + " px off");
  return join;
}

void VulkanSurfelMap::MoveToOldest(const DepthMap& map, const SubmapRegistration& other,
                                   const SubmapRegistration& oldest, SubmapJoin& join) {
  const Similarity motion = Between(other.registration.view, oldest.registration.view);
  const std::vector<Similarity> motions = MoveSubmap(views_, other.submap, motion);
  corrector_.Deform(recorder_, MakeNodes(views_, motions), surfels_, times_);
  const RegistrationProblem problem = MakeProblem(map, options_, other.registration.view);
  const double moved_px = ImageMotion(problem, Deviation(problem, oldest.registration.view));
  if (moved_px < join.moved_px) return;
  join.moved_px = moved_px;
  join.scale = motion.scale();
}

// What two parts both show. Returns the number of surfels that became one with another.
std::int64_t VulkanSurfelMap::MergeAcross(const std::vector<bool>& is_other) {
  const std::int64_t num_merged = MergeOverlaps(ViewsAcross(views_, is_other, kMaxViewsOfJoin));
  surfels_.Compact();
  return num_merged;
}

// The next depth map is fused as this view.
void VulkanSurfelMap::AddView(const FusedView& view) {
  if (!views_.empty() && views_.back().submap != view.submap) {
    past_views_.Clear();  // of another submap
    const std::vector<FusedView> between = BreakBetween(views_.back(), view);
    views_.insert(views_.end(), between.begin(), between.end());
  }
  num_depth_maps_ = static_cast<std::uint32_t>(views_.size());
  views_.push_back(view);
}

std::vector<MovedView> VulkanSurfelMap::MovedViews() const {
  std::vector<MovedView> moved;
  for (const FusedView& view : views_) {
    if (!view.is_break) moved.push_back({view.frame_index, view.T_world_cam, view.depth_scale});
  }
  return moved;
}

std::optional<CorrectionResult> VulkanSurfelMap::Join(SurfelMap& other, const MapJoin& join) {
  auto* theirs = dynamic_cast<VulkanSurfelMap*>(&other);
  if (theirs == nullptr || theirs == this || map_id_.value_or(join.map_id) != join.map_id) {
    return std::nullopt;
  }
  surfels_.Compact();
  theirs->surfels_.Compact();
  const std::size_t num_views = views_.size() + theirs->views_.size() + 2 * kDeformationWindow;
  if (num_views >= kMaxDepthMaps || !MakeRoom(theirs->surfels_.size())) return std::nullopt;
  CorrectionResult result;
  map_id_ = join.map_id;
  result.num_merged = Correct(join.corrections).num_merged;
  theirs->MoveInto(join);
  if (!theirs->views_.empty()) result.num_merged += Append(*theirs);
  result.views = MovedViews();
  result.num_surfels = num_surfels();
  return result;
}

// To where the world of this model is from now on.
void VulkanSurfelMap::MoveInto(const MapJoin& join) {
  std::vector<KeyframeCorrection> corrections(join.corrections.begin(), join.corrections.end());
  for (const FusedView& view : views_) {
    const bool is_known =
        std::any_of(join.corrections.begin(), join.corrections.end(),
                    [&](const KeyframeCorrection& c) { return c.id == view.keyframe_id; });
    if (is_known) continue;
    corrections.push_back({view.keyframe_id, join.map_id, join.S_this_other * view.T_tracker_cam,
                           view.tracker_scale * join.S_this_other.scale()});
  }
  map_id_ = join.map_id;
  (void)Correct(corrections);
}

// Makes another model in the same world, which is empty afterwards, a part of this one. Its submaps
// are further ones; but where as much of them lies upon this one as a depth map would have to show,
// within the noise of both, two become one. Returns the number of surfels that were merged.
std::int64_t VulkanSurfelMap::Append(VulkanSurfelMap& other) {
  const int first_submap = views_.empty() ? 0 : Submaps(views_).back() + 1;
  for (FusedView& view : other.views_) view.submap += first_submap;
  AddView(other.views_.front());
  const std::uint32_t first_view = num_depth_maps_;
  views_.insert(views_.end(), other.views_.begin() + 1, other.views_.end());
  num_depth_maps_ = static_cast<std::uint32_t>(views_.size());
  surfels_.Append(other.surfels_.Download(), first_view);
  for (const auto& [id, scale] : other.scale_of_keyframe_) scale_of_keyframe_[id] = scale;
  tracker_is_astray_ = other.tracker_is_astray_;
  merge_radius_px_ = std::max(merge_radius_px_, other.merge_radius_px_);
  past_views_.Clear();
  std::vector<bool> is_other(views_.size());
  std::fill(is_other.begin() + first_view, is_other.end(), true);

  other.surfels_.Upload({});
  other.views_.clear();
  other.num_depth_maps_ = 0;
  other.map_id_.reset();
  other.scale_of_keyframe_.clear();
  other.Rest();
  const std::int64_t num_merged = MergeAcross(is_other);
  const CameraModel& camera = views_.back().camera;
  const double needed = options_.gate.min_overlap * camera.width * camera.height;
  if (first_submap == 1 && num_submaps() == 2 && static_cast<double>(num_merged) >= needed) {
    for (FusedView& view : views_) view.submap = views_.front().submap;
  }
  return num_merged;
}

void VulkanSurfelMap::Rest() {
  past_views_.Clear();
  buffers_ = {};
  width_px_ = height_px_ = 0;
}

}  // namespace mono3d
