// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/frame_refiner.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "image/state_archive.h"
#include "tracking/map/map_checks.h"
#include "tracking/map/map_state.h"
#include "tracking/motion_model.h"
#include "tracking/optimisation/view_pose.h"

namespace mono3d::tracking {
namespace {

// On each side of a frame, of those that its velocity is taken from.
constexpr std::size_t kNeighbours = 2;
// Of a map whose frames are all kept, in keyframes and in frames: so that memory and the time to
// settle it do not grow with the flight, or with a camera that hovers.
constexpr std::size_t kMaxKeyframes = 96;
constexpr std::size_t kMaxFrames = 2000;

View OnlyWhatShowsPoints(const View& view) {
  View result;
  result.frame = view.frame;
  result.frame.bgr.release();
  for (std::size_t i = 0; i < view.features.size(); ++i) {
    if (!view.points[i]) continue;
    result.features.push_back(view.features[i]);
    result.points.push_back(view.points[i]);
  }
  return result;
}

}  // namespace

void FrameRefiner::Add(std::size_t number, const View& view) {
  const auto position = std::upper_bound(
      frames_.begin(), frames_.end(), view.frame.index,
      [](std::int64_t index, const TrackedFrame& of) { return index < of.view.frame.index; });
  frames_.insert(position, {number, OnlyWhatShowsPoints(view), false});
}

void FrameRefiner::ForgetFrom(std::size_t number) {
  std::erase_if(frames_, [&](const TrackedFrame& frame) { return frame.number >= number; });
}

std::vector<View> FrameRefiner::ViewsFrom(std::int64_t frame_index) const {
  std::vector<View> views;
  for (const TrackedFrame& frame : frames_) {
    if (frame.view.frame.index < frame_index || atlas_->KeyframeOf(frame.number)) continue;
    views.push_back(frame.view);
    views.back().T_cam_world = atlas_->T_cam_world(frame.number);
  }
  return views;
}

void FrameRefiner::Renumber(const NumberShift& shift) {
  for (TrackedFrame& frame : frames_) {
    for (std::optional<PointId>& point : frame.view.points) point->index += shift.points;
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

void FrameRefiner::TakeVelocity(std::size_t position, View& view) const {
  const std::size_t first = position - std::min(position, kNeighbours);
  const std::size_t last = std::min(position + kNeighbours, frames_.size() - 1);
  MotionModel motion;
  for (std::size_t i = first; i < last; ++i) {
    motion.Add(atlas_->T_cam_world(frames_[i + 1].number) *
                   atlas_->T_cam_world(frames_[i].number).Inverse(),
               frames_[i + 1].view.frame.timestamp_s - frames_[i].view.frame.timestamp_s);
  }
  view.velocity_prior = motion.Velocity(last - position);
}

void FrameRefiner::AdjustFrame(std::size_t position) {
  const TrackedFrame& frame = frames_[position];
  const bool is_global = IsGlobal();
  if (const std::optional<KeyframeId> keyframe = atlas_->KeyframeOf(frame.number)) {
    // Before a frame has come after it, the tracker's prediction is as good.
    if (is_global || position + 1 == frames_.size()) return;
    View& of_map = atlas_->map().keyframe(*keyframe).view;
    View view = frame.view;
    TakeVelocity(position, view);
    of_map.shutter = {of_map.frame.sensor, view.velocity_prior.mean};
    return;
  }
  View view = frame.view;
  view.T_cam_world = atlas_->T_cam_world(frame.number);
  if (!is_global) TakeVelocity(position, view);
  const PoseResult pose = RefinePose(atlas_->map(), view);
  // Else points that it rested on are gone.
  if (pose.num_inliers >= min_inliers_) atlas_->MoveFrame(frame.number, view);
}

void FrameRefiner::AdjustFrames(const Positions& positions) {
  if (positions.empty()) return;
  // Better poses give better velocities, and these better poses.
  const int num_rounds = IsGlobal() ? 1 : 2;
  for (int round = 0; round < num_rounds; ++round) {
    for (const std::size_t i : positions) AdjustFrame(i);
  }
}

void FrameRefiner::Refine() {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  const std::int64_t end = EndOfFinalPart();
  const bool is_global = IsGlobal();
  Positions due;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (frames_[i].is_final) continue;
    frames_[i].is_final = frames_[i].view.frame.index < end;
    if (frames_[i].is_final || !is_global) due.push_back(i);
  }
  AdjustFrames(due);
  if (HoldsWholeMap()) return;
  while (frames_.size() > kNeighbours && frames_[kNeighbours].is_final) frames_.pop_front();
}

void FrameRefiner::RefineAll() {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  // Where earlier ones are gone, the first ones lack those that their velocities were taken from.
  const std::size_t first = HoldsWholeMap() ? 0 : std::min(kNeighbours, frames_.size());
  Positions every(frames_.size() - first);
  std::iota(every.begin(), every.end(), first);
  AdjustFrames(every);
}

void FrameRefiner::Finish() {
  if (!atlas_->IsInUse() || frames_.empty()) return;
  const bool is_whole = HoldsWholeMap();
  Positions due;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (!frames_[i].is_final || is_whole) due.push_back(i);
  }
  AdjustFrames(due);
  frames_.clear();
}

template <typename Archive>
void FrameRefiner::ExchangeState(Archive& archive) {
  archive.Sections(frames_, 1, [&](TrackedFrame& frame) {
    archive.Index(frame.number);
    tracking::ExchangeState(archive, frame.view);
    archive.Number(frame.is_final);
  });
  if constexpr (Archive::kReads) {
    if (!IsConsistent()) archive.Refuse("contradicts itself");
  }
}

template void FrameRefiner::ExchangeState(StateWriter&);
template void FrameRefiner::ExchangeState(StateReader&);

// All frames are of the map in use, and all their features have points.
bool FrameRefiner::IsConsistent() const {
  if (frames_.empty()) return true;
  const auto is_of_map = [&](const TrackedFrame& frame) {
    return frame.number < atlas_->num_frames() &&
           atlas_->map_of_frame(frame.number) == atlas_->current() &&
           IsViewOf(atlas_->map(), frame.view) &&
           std::ranges::all_of(frame.view.points,
                               [](const auto& point) { return point.has_value(); });
  };
  return atlas_->IsInUse() && std::ranges::all_of(frames_, is_of_map);
}

}  // namespace mono3d::tracking
