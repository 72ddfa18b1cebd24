// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/map_start.h"

#include <utility>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/optimisation/map_adjustment.h"

namespace mono3d::tracking {
namespace {

// Gives a point of the start its patch from the first view and its position in the second to a
// fraction of a pixel.
void RefineStartByPatchAlignment(Map& map, PointId point) {
  const Observation in_a = map.point(point).observations.front();
  const Observation in_b = map.point(point).observations.back();
  Feature& a = map.keyframe(in_a.keyframe).view.features[in_a.feature];
  Feature& b = map.keyframe(in_b.keyframe).view.features[in_b.feature];
  if (!TakePatchOf(map, point, in_a.keyframe, a)) return;
  const auto found = FindPatch(map, point, map.keyframe(in_b.keyframe).view, b.pixel);
  if (!found) return;
  b.pixel = found->pixel;
  b.sigma_px = found->sigma_px;
  a.sigma_px = found->sigma_px;
}

}  // namespace

namespace {

// By the motion between the two views, until that of their neighbours is known.
void SetStartVelocity(const MapStart& start, Map& map) {
  const double duration_s = start.second.frame.timestamp_s - start.first.frame.timestamp_s;
  const CameraVelocity velocity = VelocityOf(start.motion.T_b_a, duration_s);
  for (const KeyframeId id : {0, 1}) {
    View& view = map.keyframe(id).view;
    view.shutter = {view.frame.sensor, velocity};
  }
}

}  // namespace

void FillMap(const MapStart& start, Map& map) {
  View a = start.first;
  View b = start.second;
  a.T_cam_world = Pose();
  b.T_cam_world = start.motion.T_b_a;
  const KeyframeId id_a = map.AddKeyframe(std::move(a));
  const KeyframeId id_b = map.AddKeyframe(std::move(b));
  for (std::size_t i = 0; i < start.motion.matches.size(); ++i) {
    const PointId point = map.AddPoint(start.motion.p_a[i]);
    map.AddObservation(point, {id_a, start.motion.matches[i].feature_a});
    map.AddObservation(point, {id_b, start.motion.matches[i].feature_b});
    map.UpdatePoint(point);
    RefineStartByPatchAlignment(map, point);
  }
  // Two views alone know less than those that the motion was adjusted over, above all of a plane.
  if (start.motion.is_adjusted) {
    RemoveOutliers(map);
    SetStartVelocity(start, map);
  } else {
    SetStartVelocity(start, map);
    AdjustAll(map);
  }
  const float median = UpperMedianOrZero(map.Depths(map.keyframe(id_a).view));
  if (median > 0) map.Rescale(1 / median);
}

}  // namespace mono3d::tracking
