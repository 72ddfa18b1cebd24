// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/point_culling.h"

#include <optional>
#include <vector>

#include "tracking/alignment/point_patches.h"
#include "tracking/features/matching.h"
#include "tracking/map/point_set.h"

namespace mono3d::tracking {
namespace {

// As in ORB-SLAM (Mur-Artal, Montiel, Tardos 2015, section VI.B), as the probation is.
constexpr double kMinFoundRatio = 0.25;

bool IsDue(const Map& map, PointId id, const View& view) {
  const MapPoint& point = map.point(id);
  const KeyframeId from = point.patch ? point.patch_keyframe : point.observations.back().keyframe;
  return ProjectMapPoint(map, id, view) && LooksAlike(map, point, from, view.Centre());
}

bool IsOnProbation(const MapPoint& point, KeyframeId newest) {
  constexpr KeyframeId kProbation = 3;  // keyframes
  return point.created_at + kProbation >= newest;
}

// New points have to prove themselves at once.
bool HasFailedProbation(const MapPoint& point, KeyframeId newest) {
  if (!IsOnProbation(point, newest)) return false;
  const bool rarely_found = point.num_found < kMinFoundRatio * point.num_predicted;
  const bool rarely_seen =
      newest >= point.created_at + 2 && point.observations.size() < kMinConfirmedObservations;
  return rarely_found || rarely_seen;
}

// A camera that flies straight on has a point in view for 16 keyframes: images as wide as 1.15 of
// the depth, 0.07 from one to the next. Two of them make it. It is due in more where the camera
// stays or comes back.
bool IsStale(const MapPoint& point) {
  constexpr int kMinDue = 15;  // keyframes
  return point.num_due_keyframes >= kMinDue &&
         point.num_showing_keyframes < kMinFoundRatio * point.num_due_keyframes;
}

}  // namespace

void CountShown(Map& map, KeyframeId keyframe) {
  const View& view = map.keyframe(keyframe).view;
  PointSet counted(map);
  for (const Covisible& other : map.CovisibleKeyframes(keyframe)) {
    for (const std::optional<PointId>& id : map.keyframe(other.keyframe).view.points) {
      if (!id || !counted.Insert(*id)) continue;
      MapPoint& point = map.point(*id);
      if (point.created_at >= keyframe) continue;
      const bool is_shown = map.FeatureOf(*id, keyframe).has_value();
      if (!is_shown && !IsDue(map, *id, view)) continue;
      ++point.num_due_keyframes;
      point.num_showing_keyframes += is_shown ? 1 : 0;
      map.Watch(*id);
    }
  }
}

void CullPoints(Map& map) {
  const KeyframeId newest = map.keyframes().size() - 1;
  for (const PointId id : map.TakeWatched()) {
    const MapPoint& point = map.point(id);
    if (HasFailedProbation(point, newest) || IsStale(point)) {
      map.RemovePoint(id);
    } else if (IsOnProbation(point, newest)) {
      map.Watch(id);
    }
  }
}

}  // namespace mono3d::tracking
