// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/keyframe_scales.h"

namespace mono3d {

void KeyframeScales::Take(std::span<const KeyframeCorrection> corrections) {
  for (const KeyframeCorrection& correction : corrections) {
    scales_[correction.id] = correction.scale;
  }
}

double KeyframeScales::Of(std::int64_t keyframe_id) const {
  const auto known = scales_.find(keyframe_id);
  return known == scales_.end() ? 1 : known->second;
}

void MoveBundle(std::span<const KeyframeCorrection> corrections, const KeyframeScales& scales,
                ImageBundle& bundle) {
  for (const KeyframeCorrection& correction : corrections) {
    for (Keyframe& keyframe : bundle.keyframes) {
      if (keyframe.id != correction.id) continue;
      const double ratio = correction.scale / scales.Of(keyframe.id);
      keyframe.map_id = correction.map_id;
      keyframe.T_world_cam = correction.T_world_cam;
      for (float& depth_su : keyframe.sparse_depths_su) depth_su *= static_cast<float>(ratio);
    }
  }
}

}  // namespace mono3d
