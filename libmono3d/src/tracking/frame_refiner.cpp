// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/frame_refiner.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "image/image_state.h"
#include "image/state_archive.h"
#include "tracking/map/map_checks.h"
#include "tracking/map/map_state.h"
#include "tracking/motion_model.h"
#include "tracking/optimisation/view_pose.h"

namespace mono3d::tracking {
namespace {

// On each side of a frame, of those that its velocity is taken from.
constexpr std::size_t kNeighbours = MotionModel::kMaxOnSide;
// Of a map whose frames are all kept, so that memory (500 points of 32 bytes in 5000 frames: 80 MB)
// and the time to settle it (2 to 3 s of 500 frames and 260 keyframes) are bounded.
constexpr std::size_t kMaxKeyframes = 500;
constexpr std::size_t kMaxFrames = 5000;

}  // namespace

void FrameRefiner::Add(std::size_t number, const View& view) {
  TrackedFrame added{number, view.frame, {}, false};
  added.frame.bgr.release();
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    if (!view.points[i]) continue;
    const Feature& feature = view.features[i];
    added.sightings.push_back({feature.pixel, feature.sigma_px, *view.points[i]});
  }
  added.sightings.shrink_to_fit();
  const auto position = std::upper_bound(
      frames_.begin(), frames_.end(), view.frame.index,
      [](std::int64_t index, const TrackedFrame& of) { return index < of.frame.index; });
  frames_.insert(position, std::move(added));
}

void FrameRefiner::ForgetFrom(std::size_t number) {
  std::erase_if(frames_, [&](const TrackedFrame& frame) { return frame.number >= number; });
}

View FrameRefiner::ViewOf(const TrackedFrame& frame) const {
  View view;
  view.frame = frame.frame;
  view.T_cam_world = atlas_->T_cam_world(frame.number);
  view.features.reserve(frame.sightings.size());
  view.points.reserve(frame.sightings.size());
  for (const Sighting& sighting : frame.sightings) {
    Feature& feature = view.features.emplace_back();
    feature.pixel = sighting.pixel;
    feature.sigma_px = sighting.sigma_px;
    view.points.emplace_back(sighting.point);
  }
  return view;
}

std::vector<View> FrameRefiner::ViewsFrom(std::int64_t frame_index) const {
  std::vector<View> views;
  for (const TrackedFrame& frame : frames_) {
    if (frame.frame.index < frame_index || atlas_->KeyframeOf(frame.number)) continue;
    views.push_back(ViewOf(frame));
  }
  return views;
}

void FrameRefiner::Renumber(const NumberShift& shift) {
  for (TrackedFrame& frame : frames_) {
    for (Sighting& sighting : frame.sightings) sighting.point.index += shift.points;
  }
}

bool FrameRefiner::HoldsWholeMap() const {
  if (!atlas_->IsInUse() || frames_.empty() || IsGlobal()) return false;
  if (atlas_->HasLoadedKeyframes()) return false;
  const std::vector<KeyframeId>& in_order = atlas_->map().InOrderOfFlight();
  if (in_order.empty() || in_order.size() > kMaxKeyframes || frames_.size() > kMaxFrames) {
    return false;
  }
  // Frames are dropped from the first one on.
  return std::ranges::any_of(frames_, [&](const TrackedFrame& frame) {
    return atlas_->KeyframeOf(frame.number) == in_order.front();
  });
}

// The frame index of the first keyframe that is still to be adjusted, or of the last one.
std::int64_t FrameRefiner::EndOfFinalPart() const {
  Map& map = atlas_->map();
  if (map.InOrderOfFlight().empty()) return -1;
  const std::span<const KeyframeId> rest = map.FromFirstNotFinal();
  const KeyframeId at_end = rest.empty() ? map.InOrderOfFlight().back() : rest.front();
  return map.keyframe(at_end).view.frame.index;
}

VelocityPrior FrameRefiner::VelocityAt(std::size_t position) const {
  const std::size_t first = position - std::min(position, kNeighbours);
  const std::size_t last = std::min(position + kNeighbours, frames_.size() - 1);
  MotionModel motion;
  for (std::size_t i = first; i < last; ++i) {
    motion.Add(atlas_->T_cam_world(frames_[i + 1].number) *
                   atlas_->T_cam_world(frames_[i].number).Inverse(),
               frames_[i + 1].frame.timestamp_s - frames_[i].frame.timestamp_s);
  }
  return motion.Velocity(last - position);
}

void FrameRefiner::AdjustFrame(std::size_t position) {
  const TrackedFrame& frame = frames_[position];
  const bool is_global = IsGlobal();
  if (const std::optional<KeyframeId> keyframe = atlas_->KeyframeOf(frame.number)) {
    // Before a frame has come after it, the tracker's prediction is as good.
    if (is_global || position + 1 == frames_.size()) return;
    View& of_map = atlas_->map().keyframe(*keyframe).view;
    of_map.shutter = {of_map.frame.sensor, VelocityAt(position).mean};
    return;
  }
  View view = ViewOf(frame);
  if (!is_global) view.velocity_prior = VelocityAt(position);
  const PoseResult pose = RefinePose(atlas_->map(), view);
  // Else points that it rested on are gone.
  if (pose.num_inliers >= min_inliers_) atlas_->MoveFrame(frame.number, view);
}

void FrameRefiner::AdjustFrames(const FrameIndices& frames, MappingLock& lock) {
  if (frames.empty()) return;
  // Better poses give better velocities, and these better poses.
  const int num_rounds = IsGlobal() ? 1 : 2;
  for (int round = 0; round < num_rounds; ++round) {
    for (const std::int64_t index : frames) {
      const auto frame = std::ranges::lower_bound(
          frames_, index, {}, [](const TrackedFrame& of) { return of.frame.index; });
      AdjustFrame(static_cast<std::size_t>(frame - frames_.begin()));
      lock.Yield();
    }
  }
}

void FrameRefiner::Refine() {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  const std::int64_t end = EndOfFinalPart();
  const bool is_global = IsGlobal();
  FrameIndices due;
  for (TrackedFrame& frame : frames_) {
    if (frame.is_final) continue;
    frame.is_final = frame.frame.index < end;
    if (frame.is_final || !is_global) due.push_back(frame.frame.index);
  }
  MappingLock alone;
  AdjustFrames(due, alone);
  if (HoldsWholeMap()) return;
  while (frames_.size() > kNeighbours && frames_[kNeighbours].is_final) frames_.pop_front();
}

void FrameRefiner::RefineAll(MappingLock& lock) {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  // Where earlier ones are gone, the first ones lack those that their velocities were taken from.
  const std::size_t first = HoldsWholeMap() ? 0 : std::min(kNeighbours, frames_.size());
  FrameIndices every;
  for (std::size_t i = first; i < frames_.size(); ++i) {
    every.push_back(frames_[i].frame.index);
  }
  AdjustFrames(every, lock);
}

void FrameRefiner::Finish() {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  const bool is_whole = HoldsWholeMap();
  FrameIndices due;
  for (const TrackedFrame& frame : frames_) {
    if (!frame.is_final || is_whole) due.push_back(frame.frame.index);
  }
  MappingLock alone;
  AdjustFrames(due, alone);
  frames_.clear();
}

template <typename Archive>
void FrameRefiner::ExchangeState(Archive& archive) {
  archive.Sections(frames_, 1, [&](TrackedFrame& frame) {
    archive.Index(frame.number);
    mono3d::ExchangeState(archive, frame.frame);
    archive.List(frame.sightings, [&](Sighting& sighting) {
      ExchangeElements(archive, sighting.pixel);
      ExchangeBounded(archive, sighting.sigma_px);
      tracking::ExchangeState(archive, sighting.point);
    });
    archive.Number(frame.is_final);
  });
  if constexpr (Archive::kReads) {
    if (!IsConsistent()) archive.Refuse("contradicts itself");
  }
}

template void FrameRefiner::ExchangeState(StateWriter&);
template void FrameRefiner::ExchangeState(StateReader&);

// All frames are of the map in use.
bool FrameRefiner::IsConsistent() const {
  if (frames_.empty()) return true;
  const auto is_of_map = [&](const TrackedFrame& frame) {
    return frame.number < atlas_->num_frames() &&
           atlas_->map_of_frame(frame.number) == atlas_->current() &&
           IsViewOf(atlas_->map(), ViewOf(frame));
  };
  return atlas_->IsInUse() && std::ranges::all_of(frames_, is_of_map);
}

}  // namespace mono3d::tracking
