// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/lost_frames.h"

#include <algorithm>
#include <map>

namespace mono3d::tools {

std::vector<FrameOutcome> FrameOutcomes(const std::vector<FrameNote>& notes,
                                        const Reconstruction& reconstruction) {
  std::set<std::int64_t> with_pose;
  for (const MapReconstruction& map : reconstruction.maps) {
    for (const TrajectoryEntry& entry : map.trajectory) with_pose.insert(entry.frame_index);
  }
  std::vector<FrameOutcome> outcomes;
  outcomes.reserve(notes.size());
  for (const FrameNote& note : notes) {
    const FrameFate fate = !with_pose.contains(note.frame_index) ? FrameFate::kLost
                           : note.is_tracked                     ? FrameFate::kTracked
                                                                 : FrameFate::kRecovered;
    const auto unplaced = reconstruction.unplaced_photos.find(note.frame_index);
    const bool is_unplaced = unplaced != reconstruction.unplaced_photos.end();
    outcomes.push_back(
        {note.frame_index, fate, is_unplaced ? unplaced->second : note.reason, note.photo});
  }
  return outcomes;
}

std::vector<LostStretch> LostStretches(const std::vector<FrameOutcome>& outcomes) {
  std::vector<LostStretch> stretches;
  std::map<std::string, std::int64_t> reasons;
  bool goes_on = false;
  for (const FrameOutcome& outcome : outcomes) {
    const bool was_lost = goes_on;
    goes_on = outcome.fate == FrameFate::kLost;
    if (!goes_on) continue;
    if (!was_lost || !outcome.photo.empty()) {
      stretches.push_back(
          {.first_frame = outcome.frame_index, .reason = {}, .photo = outcome.photo});
      reasons.clear();
    }
    LostStretch& stretch = stretches.back();
    stretch.last_frame = outcome.frame_index;
    ++stretch.num_frames;
    const std::int64_t count = ++reasons[outcome.reason];
    if (stretch.reason.empty() || count > reasons[stretch.reason]) stretch.reason = outcome.reason;
  }
  std::ranges::stable_sort(stretches, std::greater<>(), &LostStretch::num_frames);
  return stretches;
}

}  // namespace mono3d::tools
