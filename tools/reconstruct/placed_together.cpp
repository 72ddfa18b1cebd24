// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/placed_together.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "common/advice.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/footage.h"
#include "mono3d/tracking/photo_mapper.h"
#include "reconstruct/footage.h"

namespace mono3d::tools {
namespace {

// So many of them in one map that no other way is tried.
double EnoughImages(const RunOutcome& tracked) {
  constexpr double kShare = 0.9;
  return kShare * static_cast<double>(tracked.num_images);
}

// So many of them at most, evenly, the first and the last among them.
std::vector<std::int64_t> EvenlyChosen(const std::vector<std::int64_t>& images, std::size_t num) {
  if (images.size() <= num) return images;
  std::vector<std::int64_t> chosen;
  for (std::size_t i = 0; i < num; ++i) {
    chosen.push_back(images[i * (images.size() - 1) / (num - 1)]);
  }
  return chosen;
}

}  // namespace

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
    std::vector<std::int64_t>& images = outcome.images_of_maps.emplace_back();
    for (const TrajectoryEntry& frame : map.trajectory) images.push_back(frame.frame_index);
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
  constexpr std::int64_t kFewestImages = 3;
  if (!tracked.was_tracked || arguments.photos != 0 || arguments.pipeline.is_live ||
      arguments.finishes || !arguments.map.empty() || !arguments.save_map.empty()) {
    return false;
  }
  const double enough = EnoughImages(tracked);
  const bool were_all_followed =
      !tracked.was_track_lost && static_cast<double>(tracked.num_posed) >= enough;
  return tracked.num_images >= kFewestImages && !were_all_followed &&
         tracked.num_images / StrideOfPlacing(arguments, tracked) <= kMostImagesPlacedTogether &&
         static_cast<double>(tracked.num_in_model) < enough;
}

bool ShowOtherPlaces(const ReconstructArguments& arguments, const RunOutcome& tracked) {
  constexpr std::size_t kNumMatched = 24;  // of all maps
  constexpr std::size_t kFewestOfMap = 4;
  const std::size_t num_maps = tracked.images_of_maps.size();
  if (num_maps < 2 || num_maps > kNumMatched / kFewestOfMap ||
      static_cast<double>(tracked.num_posed) < EnoughImages(tracked)) {
    return false;
  }
  const CameraModel as_taken = CameraAsTaken(arguments.input, arguments.camera);
  std::vector<GroupedImage> images;
  for (std::size_t map = 0; map < num_maps; ++map) {
    for (const std::int64_t index :
         EvenlyChosen(tracked.images_of_maps[map], kNumMatched / num_maps)) {
      images.push_back({map, [&arguments, &as_taken, index]() -> std::optional<Frame> {
                          FrameSourceOptions one = arguments.source;
                          one.stride = 1;
                          one.start = static_cast<int>(index);
                          one.max_frames = 1;
                          one.seeks = true;
                          try {
                            return OpenFrameSource(arguments.input, as_taken, one)->Next();
                          } catch (const Error&) {
                            return std::nullopt;
                          }
                        }});
    }
  }
  PhotoMapperOptions options = arguments.pipeline.photos;
  options.stop = &StopRequested();
  return !ShowTheSame(images, options) && !StopRequested();
}

std::string OtherPlacesLine(const RunOutcome& tracked) {
  return std::to_string(tracked.num_in_model) + " of " + std::to_string(tracked.num_images) +
         " images are in the model; the others are in " +
         std::to_string(tracked.images_of_maps.size() - 1) +
         (tracked.images_of_maps.size() == 2 ? " map" : " maps") +
         " of other places, with which it has nothing in common";
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
