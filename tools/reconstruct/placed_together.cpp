// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/placed_together.h"

#include <algorithm>

#include "common/advice.h"
#include "mono3d/pipeline/footage.h"

namespace mono3d::tools {

RunOutcome OutcomeOf(const Reconstruction& reconstruction, const RunRecord& record,
                     const std::string& why_no_model) {
  RunOutcome outcome;
  outcome.is_whole = record.end == RunEnd::kFinished && why_no_model.empty();
  outcome.why_no_model = why_no_model;
  outcome.was_tracked =
      record.end == RunEnd::kFinished && !record.are_photos && !record.is_sparse_video;
  outcome.was_track_lost = WasTrackLost(reconstruction.counts);
  outcome.wall_s = record.wall_s;
  outcome.num_images = reconstruction.counts.num_frames;
  for (const MapReconstruction& map : reconstruction.maps) {
    outcome.num_posed += static_cast<std::int64_t>(map.trajectory.size());
  }
  if (reconstruction.counts.num_keyframes > 0) {
    outcome.images_per_keyframe = static_cast<double>(reconstruction.counts.num_tracked) /
                                  static_cast<double>(reconstruction.counts.num_keyframes);
  }
  if (!reconstruction.maps.empty()) {
    const MapReconstruction& model = reconstruction.maps.front();
    outcome.is_broken = model.health.state == HealthState::kBroken;
    outcome.num_in_model = model.trajectory.size();
  }
  return outcome;
}

bool MayBePlacedTogether(const ReconstructArguments& arguments, const RunOutcome& tracked) {
  constexpr double kFewInModel = 0.9;
  constexpr std::int64_t kFewestImages = 3;
  if (!tracked.was_tracked || arguments.photos != 0 || arguments.pipeline.is_live ||
      arguments.finishes || !arguments.map.empty() || !arguments.save_map.empty()) {
    return false;
  }
  const auto enough = kFewInModel * static_cast<double>(tracked.num_images);
  const bool were_all_followed =
      !tracked.was_track_lost && static_cast<double>(tracked.num_posed) >= enough;
  return tracked.num_images >= kFewestImages && !were_all_followed &&
         tracked.num_images / StrideOfPlacing(arguments, tracked) <= kMostImagesPlacedTogether &&
         static_cast<double>(tracked.num_in_model) < enough;
}

int StrideOfPlacing(const ReconstructArguments& arguments, const RunOutcome& tracked) {
  constexpr double kPlacedPerKeyframe = 2;
  if (arguments.source.stride == kStrideByMotion) return 1;  // they were chosen already
  return std::max(1, static_cast<int>(tracked.images_per_keyframe / kPlacedPerKeyframe));
}

std::string PlacedTogetherLine(const RunOutcome& tracked, int stride) {
  return std::to_string(tracked.num_in_model) + " of " + std::to_string(tracked.num_images) +
         " images could be followed from one to the next: " +
         (stride == 1 ? "all are" : "one of " + std::to_string(stride) + " is") +
         " placed together now, whenever they were taken (--video: not)";
}

}  // namespace mono3d::tools
