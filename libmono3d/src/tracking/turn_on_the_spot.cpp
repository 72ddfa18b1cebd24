// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/turn_on_the_spot.h"

#include <cmath>
#include <limits>
#include <string>

#include "image/state_archive.h"
#include "mono3d/core/log.h"
#include "tracking/held_scale.h"
#include "tracking/map/depth_uncertainty.h"
#include "tracking/map/map_checks.h"
#include "tracking/optimisation/map_adjustment.h"

namespace mono3d::tracking {
namespace {

// Of the points in view: from so many directions on the map is watched,
constexpr double kMany = 0.1;
// by so few the depths are known again,
constexpr double kFew = 0.1;
// and beyond so many those of known depth are the minority, and no longer hold the scale alone.
constexpr double kMost = 0.5;

// Of the points that a keyframe sees, the share that keyframes before `start` see as well.
double ShareSeenBefore(const Map& map, KeyframeId keyframe, KeyframeId start) {
  int num_points = 0;
  int num_before = 0;
  for (const std::optional<PointId>& point : map.keyframe(keyframe).view.points) {
    if (!point) continue;
    ++num_points;
    num_before += map.point(*point).observations.front().keyframe < start ? 1 : 0;
  }
  return num_points > 0 ? static_cast<double>(num_before) / num_points : 0;
}

}  // namespace

void TurnOnTheSpot::End() {
  start_.reset();
  cut_.reset();
  frames_.Clear();
}

void TurnOnTheSpot::Abandon() {
  if (cut_) {
    is_refused_ = true;
  } else {
    End();
  }
}

void TurnOnTheSpot::Renumber(const NumberShift& shift) {
  if (start_) *start_ += shift.keyframes;
  if (cut_) *cut_ += shift.keyframes;
}

void TurnOnTheSpot::Follow(Map& map, KeyframeId keyframe, const FrameRefiner& refiner,
                           MappingLock& lock) {
  if (is_refused_) return;
  const double share = ShareOfDirections(map, map.keyframe(keyframe).view);
  if (!start_ && share > kMany) start_ = keyframe;
  if (!start_) return;
  if (!cut_ && share > kMost) cut_ = keyframe;
  if (share > kFew) return;
  if (cut_ && ShareSeenBefore(map, keyframe, *start_) < kMost) {
    Judge(map, refiner, lock);
  } else {
    End();  // back where it came from, or never away from it
  }
}

void TurnOnTheSpot::Judge(Map& map, const FrameRefiner& refiner, MappingLock& lock) {
  if (is_refused_ || !start_) return;
  if (!cut_) return End();
  const std::optional<ScaleAcross> scale =
      AdjustAcross(map, *start_, refiner.ViewsFrom(map.keyframe(*start_).view.frame.index), lock);
  if (!scale) return;  // interrupted: once more with the next keyframe
  const bool is_held = scale->sigma <= kMaxScaleSigma;
  Log(is_held ? LogLevel::kInfo : LogLevel::kWarning,
      map.keyframe(*start_).view.frame.name +
          ": turned on the spot; the scale after it is known to " + PercentText(scale->sigma) +
          " (one standard deviation)" +
          (is_held ? "" : ": a new map, at most " + PercentText(kMaxScaleSigma) + " needed"));
  if (is_held) {
    End();
  } else {
    is_refused_ = true;
  }
}

std::vector<Frame> TurnOnTheSpot::TakeBack(Atlas& atlas, FrameRefiner& refiner) {
  Map& map = atlas.map();
  const std::int64_t first_index = map.keyframe(*cut_).view.frame.index;
  KeyframeId last = *cut_ - 1;
  while (!map.keyframe(last).alive) --last;
  for (KeyframeId id = *cut_; id < map.keyframes().size(); ++id) {
    if (map.keyframe(id).alive) atlas.places().Remove(id);
  }
  const std::size_t first_frame = atlas.FirstFrameFrom(first_index);
  atlas.RemoveFramesFrom(first_frame);
  map.TakeBackKeyframes(*cut_);
  atlas.SetNewest(last);
  refiner.ForgetFrom(first_frame);
  std::vector<Frame> frames =
      frames_.Take(first_index - 1, std::numeric_limits<std::int64_t>::max());
  End();
  is_refused_ = false;
  return frames;
}

template <typename Archive>
void TurnOnTheSpot::ExchangeState(Archive& archive, const Atlas& atlas) {
  const auto exchange = [&](KeyframeId& keyframe) { archive.Index(keyframe); };
  archive.Optional(start_, exchange);
  archive.Optional(cut_, exchange);
  archive.Number(is_refused_);
  frames_.ExchangeState(archive);
  if constexpr (Archive::kReads) {
    const auto is_later = [&](const std::optional<KeyframeId>& keyframe) {
      return !keyframe ||
             (atlas.IsInUse() && *keyframe > 0 && IsKeyframeOf(atlas.map(), *keyframe));
    };
    if (!is_later(start_) || !is_later(cut_) || (cut_ && !start_) || (is_refused_ && !cut_) ||
        (cut_ && !CanBeTakenBack(atlas, *cut_))) {
      archive.Refuse("contradicts itself");
    }
  }
}

// Frames that stay refer to keyframes that stay.
bool TurnOnTheSpot::CanBeTakenBack(const Atlas& atlas, KeyframeId cut) {
  const std::size_t first_frame = atlas.FirstFrameFrom(atlas.map().keyframe(cut).view.frame.index);
  for (std::size_t i = 0; i < first_frame; ++i) {
    if (atlas.map_of_frame(i) == atlas.current() && atlas.keyframe_of_frame(i) >= cut) return false;
  }
  return true;
}

template void TurnOnTheSpot::ExchangeState(StateWriter&, const Atlas&);
template void TurnOnTheSpot::ExchangeState(StateReader&, const Atlas&);

}  // namespace mono3d::tracking
