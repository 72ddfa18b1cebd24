// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/placed_together.h"

#include "mono3d/pipeline/footage.h"

namespace mono3d::tools {

RunOutcome OutcomeOf(const Reconstruction& reconstruction, const RunRecord& record,
                     const std::string& why_no_model) {
  RunOutcome outcome;
  outcome.is_whole = record.end == RunEnd::kFinished && why_no_model.empty();
  outcome.why_no_model = why_no_model;
  outcome.was_tracked =
      record.end == RunEnd::kFinished && !record.are_photos && !record.is_sparse_video;
  outcome.wall_s = record.wall_s;
  outcome.num_images = reconstruction.counts.num_frames;
  if (!reconstruction.maps.empty()) {
    outcome.num_in_model = reconstruction.maps.front().trajectory.size();
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
  return tracked.num_images >= kFewestImages && tracked.num_images <= kMostImagesPlacedTogether &&
         static_cast<double>(tracked.num_in_model) <
             kFewInModel * static_cast<double>(tracked.num_images);
}

std::string PlacedTogetherLine(const RunOutcome& tracked) {
  return std::to_string(tracked.num_in_model) + " of " + std::to_string(tracked.num_images) +
         " images could be followed from one to the next: all are placed together now, whenever "
         "they were taken (--video: not)";
}

}  // namespace mono3d::tools
