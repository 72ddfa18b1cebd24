// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/depth_map_placer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "fusion/registration/constraint.h"
#include "fusion/registration/gate.h"
#include "fusion/state_archive.h"
#include "fusion/view.h"
#include "mono3d/core/log.h"

namespace mono3d {

// The tracker's pose; and that pose moved as the last registration moved the one before it, for a
// tracker that has drifted knows how the camera has moved since then.
Predictions DepthMapPlacer::Predict(const Similarity& S_tracker_kf) const {
  Predictions predictions = {S_tracker_kf};
  if (tracker_drifted_ && !model_.anchors.empty()) {
    predictions.push_back(model_.anchors.ModelFromTracker() * S_tracker_kf);
  }
  return predictions;
}

Placement DepthMapPlacer::Place(const DepthMap& map, const Anchor& anchor,
                                const DepthMapBuffers& buffers) {
  const Predictions predictions = Predict(anchor.S_tracker_kf);
  Placement placement;
  placement.registration.S_world_kf = predictions.front();
  if (model_.anchors.empty()) return placement;
  placement.submap = model_.anchors.SubmapOfLatest();
  if (!context_.options.registration.enabled) return placement;
  FindVisible(map, predictions);
  std::vector<SubmapRegistration> shown = RegisterWithSubmaps(map, anchor, predictions, buffers);
  if (shown.size() > 1) placement.join = JoinSubmaps(map, shown, placement.constraints);
  if (!shown.empty()) {
    placement.submap = shown.front().submap;
    placement.registration = shown.front().registration;
  } else {
    placement.registration = Register(map, anchor, predictions, buffers, visible_);
  }
  const RegistrationEvidence& evidence = placement.registration.evidence;
  if (evidence.registered && placement.registration.rejection.empty() && evidence.noise == 1) {
    misfits_.Add(evidence.tracker_misfit);
  }
  if (!placement.join && placement.registration.constraint) {
    placement.constraints = {*placement.registration.constraint};
  }
  const bool is_apart = !evidence.registered && placement.registration.rejection.empty();
  if (is_apart && context_.options.registration.moves) {
    placement.starts_submap = true;
    placement.submap = model_.anchors.NextSubmapId();
  }
  return placement;
}

void DepthMapPlacer::FindVisible(const DepthMap& map, const Predictions& predictions) {
  const ViewParams params =
      MakeViewParams(map, context_.options, model_.surfels.size(), model_.anchors.size());
  predicted_anchors_.resize(std::max(predicted_anchors_.size(), predictions.size()));
  std::vector<ModelView> views;
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    predicted_anchors_[i].Set(context_.device, predictions[i], model_.anchors.S_world_surfels());
    views.push_back({params, predicted_anchors_[i]});
  }
  const auto margin_px =
      static_cast<std::uint32_t>(std::ceil(context_.options.gate.max_deviation_px));
  context_.culler.FindVisible(context_.recorder, views, margin_px, model_.surfels, visible_,
                              context_.times);
}

Registration DepthMapPlacer::Register(const DepthMap& map, const Anchor& anchor,
                                      const Predictions& predictions,
                                      const DepthMapBuffers& buffers, const BlockList& blocks) {
  SurfelMapOptions options = context_.options;
  options.registration.max_misfit =
      misfits_.Limit(options.registration.max_misfit, map.patch_noise);
  Registration registration =
      registrar_.Register(context_.recorder, map, buffers, model_.surfels, blocks,
                          model_.anchors.S_world_surfels(), predictions, options, context_.times);
  Log(LogLevel::kDebug, "depth map of frame " + std::to_string(map.frame_index) + ": " +
                            Describe(registration.evidence));
  const bool is_found = registration.evidence.moved && registration.is_tracker_wrong;
  if (!is_found || !registration.rejection.empty()) return registration;
  const auto oldest = AnchorToTellOf(blocks.numbers(), model_.surfels.anchors());
  if (oldest && model_.anchors.anchor(*oldest).keyframe_id != map.keyframe_id) {
    registration.constraint =
        MakeConstraint({anchor, registration.S_world_kf}, registration.information,
                       model_.anchors.Placed(*oldest));
  }
  return registration;
}

// With each that it shows: those first that take it, and of these the one that it shows most of.
// Empty where the model is of one submap alone.
std::vector<DepthMapPlacer::SubmapRegistration> DepthMapPlacer::RegisterWithSubmaps(
    const DepthMap& map, const Anchor& anchor, const Predictions& predictions,
    const DepthMapBuffers& buffers) {
  std::vector<SubmapRegistration> shown;
  const std::vector<int> submaps = model_.anchors.SubmapIds();
  if (submaps.size() < 2) return shown;
  for (const int submap : submaps) {
    of_submap_.Set(context_.device, BlocksOfSubmap(visible_.numbers(), model_.surfels.anchors(),
                                                   model_.anchors, submap));
    if (of_submap_.size() == 0) continue;
    Registration registration = Register(map, anchor, predictions, buffers, of_submap_);
    if (registration.evidence.registered) shown.push_back({submap, std::move(registration)});
  }
  std::stable_sort(shown.begin(), shown.end(), [](const auto& a, const auto& b) {
    const bool is_a_fit = a.registration.rejection.empty();
    if (is_a_fit != b.registration.rejection.empty()) return is_a_fit;
    const double noise_a = a.registration.evidence.noise, noise_b = b.registration.evidence.noise;
    if (noise_a != noise_b) return noise_a < noise_b;
    return a.registration.evidence.overlap > b.registration.evidence.overlap;
  });
  return shown;
}

// Where two submaps at least are sure of the depth map: the others move to the oldest of them, with
// which the depth map is registered then; `shown` is that alone afterwards.
// Those that the tracker has elsewhere are added to `constraints`.
std::optional<SubmapJoin> DepthMapPlacer::JoinSubmaps(
    const DepthMap& map, std::vector<SubmapRegistration>& shown,
    std::vector<KeyframeConstraint>& constraints) {
  std::vector<SubmapRegistration> sure;
  std::copy_if(shown.begin(), shown.end(), std::back_inserter(sure), [&](const auto& of) {
    const RegistrationEvidence& evidence = of.registration.evidence;
    return of.registration.rejection.empty() && evidence.noise == 1 &&
           (!evidence.moved ||
            evidence.uncertainty_px <= context_.options.gate.max_join_uncertainty_px);
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
  AnchorMap& anchors = model_.anchors;
  std::vector<bool> is_other(anchors.size());
  bool is_moved = false;
  for (auto other = sure.begin() + 1; other != sure.end(); ++other) {
    for (std::uint32_t i = 0; i < anchors.size(); ++i) {
      is_other[i] = is_other[i] || anchors.SubmapOf(i) == other->submap;
    }
    if (oldest.registration.evidence.moved || other->registration.evidence.moved) {
      is_moved = true;
      MoveToOldest(map, *other, oldest, join);
    }
    anchors.JoinSubmaps(oldest.submap, other->submap);
  }
  if (is_moved) {
    join.num_merged = merger_.MergeAcross(is_other);
    model_.surfels.CloseGaps();
  }
  shown = {oldest};
  Log(LogLevel::kInfo, "depth map of frame " + std::to_string(map.frame_index) + ": joins " +
                           std::to_string(join.num_submaps) + " submap(s) of the model, " +
                           std::to_string(join.moved_px) + " px off");
  return join;
}

void DepthMapPlacer::MoveToOldest(const DepthMap& map, const SubmapRegistration& other,
                                  const SubmapRegistration& oldest, SubmapJoin& join) {
  const Similarity& S_world_kf = oldest.registration.S_world_kf;
  const Similarity motion = S_world_kf * other.registration.S_world_kf.Inverse();
  model_.anchors.MoveSubmap(other.submap, motion);
  const RegistrationProblem problem =
      MakeProblem(map, context_.options, other.registration.S_world_kf);
  const double moved_px = ImageMotion(problem, Deviation(problem, S_world_kf));
  if (moved_px < join.moved_px) return;
  join.moved_px = moved_px;
  join.scale = motion.scale();
}

template <typename Archive>
void DepthMapPlacer::Exchange(Archive& archive) {
  misfits_.Exchange(archive);
  archive.Number(tracker_drifted_);
}

template void DepthMapPlacer::Exchange(ByteWriter& archive);
template void DepthMapPlacer::Exchange(ByteReader& archive);

}  // namespace mono3d
