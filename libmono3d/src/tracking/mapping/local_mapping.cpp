// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/local_mapping.h"

#include <cstddef>

#include "tracking/alignment/patch_tracking.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/mapping/keyframe_culling.h"
#include "tracking/mapping/point_creation.h"
#include "tracking/mapping/point_culling.h"
#include "tracking/optimisation/map_adjustment.h"

namespace mono3d::tracking {

void MapKeyframeInto(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                     StageTimes* times, MappingLock& lock) {
  {
    const ScopedStageTimer timer(times, "tracking/point_creation");
    map.ReuseReleased();
    CullPoints(map);
    EstimatePatchNormals(map, keyframe);
    RenewPatches(map, keyframe);
    const bool is_far = map.Depths(map.keyframe(keyframe).view).size() < kFewPoints;
    CreatePoints(map, keyframe, options);
    if (is_far) CreatePointsByPatches(map, keyframe, options);
    lock.Yield();
    FusePoints(map, keyframe, options);
    CountShown(map, keyframe);
  }
  {
    const ScopedStageTimer timer(times, "tracking/local_bundle_adjustment");
    AdjustLocally(map, keyframe, options, lock);
  }
  lock.Yield();
  const ScopedStageTimer timer(times, "tracking/keyframe_culling");
  CullKeyframes(map, keyframe, options);
  // Images are for new points and patches, which only the newest keyframes get.
  // The neighbours of a new keyframe are among so many.
  constexpr KeyframeId kNumWithImages = 20;
  if (keyframe >= kNumWithImages) map.keyframe(keyframe - kNumWithImages).view.octaves = {};
}

}  // namespace mono3d::tracking
