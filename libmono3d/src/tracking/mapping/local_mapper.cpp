// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/local_mapper.h"

#include "tracking/alignment/patch_tracking.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/map/depth_uncertainty.h"
#include "tracking/mapping/direction_points.h"
#include "tracking/mapping/keyframe_culling.h"
#include "tracking/mapping/point_creation.h"
#include "tracking/mapping/point_culling.h"
#include "tracking/mapping/point_fusion.h"
#include "tracking/optimisation/map_adjustment.h"

namespace mono3d::tracking {
namespace {

// Images are for new points and patches, which only the newest keyframes get; what has been noted
// by then is little more than what will be.
void LetGoOfImage(View& view) {
  view.octaves = Octaves();
  view.features.shrink_to_fit();
  view.points.shrink_to_fit();
}

}  // namespace

void LocalMapper::MapKeyframe(Map& map, KeyframeId keyframe, MappingLock& lock) const {
  AddPoints(map, keyframe, lock);
  CreateDirectionPoints(map, keyframe);
  CountShown(map, keyframe);
  Adjust(map, keyframe, lock);
}

void LocalMapper::MapKnownDepths(Map& map, KeyframeId keyframe, MappingLock& lock) const {
  AddPoints(map, keyframe, lock);
  CountShown(map, keyframe);
  Adjust(map, keyframe, lock);
}

void LocalMapper::Adjust(Map& map, KeyframeId keyframe, MappingLock& lock) const {
  {
    const ScopedStageTimer timer(times_, "tracking/local_bundle_adjustment");
    AdjustLocally(map, keyframe, options_, lock);
  }
  UpdateDepthSigmas(map, keyframe);
  lock.Yield();
  const ScopedStageTimer timer(times_, "tracking/keyframe_culling");
  CullKeyframes(map, keyframe, options_);
  // The neighbours of a new keyframe are among so many.
  constexpr KeyframeId kNumWithImages = 20;
  if (keyframe >= kNumWithImages) LetGoOfImage(map.keyframe(keyframe - kNumWithImages).view);
}

void LocalMapper::AddPoints(Map& map, KeyframeId keyframe, MappingLock& lock) const {
  const ScopedStageTimer timer(times_, "tracking/point_creation");
  CullPoints(map);
  EstimatePatchNormals(map, keyframe);
  RenewPatches(map, keyframe);
  const bool is_far = map.Depths(map.keyframe(keyframe).view).size() < kFewPoints;
  CreatePoints(map, keyframe, options_);
  if (is_far) CreatePointsByPatches(map, keyframe, options_);
  lock.Yield();
  FusePoints(map, keyframe, options_);
}

}  // namespace mono3d::tracking
