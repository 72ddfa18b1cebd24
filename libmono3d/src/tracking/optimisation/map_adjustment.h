// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/map.h"
#include "tracking/priority_mutex.h"

namespace mono3d::tracking {

// Bundle adjustment of a keyframe with its most covisible ones; older ones that see the same points
// stay where they are. Outliers lose their observation. Keyframes that came meanwhile move along.
void AdjustLocally(Map& map, KeyframeId keyframe, const LocalMappingOptions& options,
                   MappingLock& lock);

// Bundle adjustment of everything; only the first keyframe stays. With a lock: false when it was
// interrupted; what it had found by then is in the map.
void AdjustAll(Map& map);
bool AdjustAll(Map& map, MappingLock& lock);

// The same, and updates the scale of each keyframe by how the depths of its points have changed.
bool AdjustAllAndScales(Map& map, MappingLock& lock);

// How large the path of newer keyframes is against that of older ones.
struct ScaleAcross {
  double log_ratio = 0;
  double sigma = 0;  // of it, see RelativePathSigma
};
// AdjustAllAndScales with further views of the map's points, which leave nothing behind, until the
// scale of the keyframes from `first_after` on against that of the older ones changes no more.
// Nothing where it was interrupted.
std::optional<ScaleAcross> AdjustAcross(Map& map, KeyframeId first_after,
                                        const std::vector<View>& views, MappingLock& lock);

// Removes the observations that do not fit the map as it is.
void RemoveOutliers(Map& map);

}  // namespace mono3d::tracking
