// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/keyframe_handover.h"

#include <algorithm>

namespace mono3d::tracking {
namespace {

// Keyframes after this many newer ones in their bundle adjustments are final.
constexpr int kMinNewer = 2;

Keyframe ToKeyframe(const Map& map, const MapKeyframe& from) {
  Keyframe keyframe;
  keyframe.id = from.id;
  keyframe.frame = from.view.frame;
  for (std::size_t i = 0; i < from.view.points.size(); ++i) {
    const std::optional<PointId>& point = from.view.points[i];
    if (!point || !map.IsAlive(*point) || map.point(*point).depth_sigma > 0) continue;
    const double z = (from.view.T_cam_world * map.point(*point).p_world).z();
    if (z <= 0) continue;
    keyframe.sparse_depths_su.push_back(static_cast<float>(z / from.scale));
    keyframe.sparse_pixels.emplace_back(from.view.features[i].pixel.cast<float>());
  }
  keyframe.velocity = from.view.shutter.velocity();
  keyframe.velocity.Rescale(1 / from.scale);
  keyframe.patch_noise = from.view.patch_noise.value_or(1);
  return keyframe;
}

}  // namespace

std::vector<Keyframe> TakeFinalised(Map& map, bool all) {
  // One that has lost sight of the newer ones is final by age: no local adjustment reaches it.
  constexpr KeyframeId kMaxAge = 8;  // keyframes
  std::vector<Keyframe> finalised;
  for (const KeyframeId id : map.FromFirstNotFinal()) {
    MapKeyframe& keyframe = map.keyframe(id);
    if (keyframe.is_finalised) continue;
    const bool is_old = id + kMaxAge < map.keyframes().size();
    if (!all && !is_old && keyframe.num_newer_adjusted < kMinNewer) break;
    finalised.push_back(ToKeyframe(map, keyframe));
    keyframe.is_finalised = true;
    keyframe.view.frame.bgr.release();
  }
  return finalised;
}

void MarkAdjusted(Map& map, KeyframeId keyframe) {
  int& count = map.keyframe(keyframe).num_newer_adjusted;
  count = std::max(count, kMinNewer);
}

}  // namespace mono3d::tracking
