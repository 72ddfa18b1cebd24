// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/image/keyframe_constraint.h"
#include "mono3d/keyframes/keyframe_selector.h"

namespace mono3d {

// What the tracker and the selector are told.
struct ModelFeedback {
  std::vector<KeyframeConstraint> constraints;  // where models have keyframes
  std::vector<DepthQuality> qualities;          // of bundles

  void Append(const ModelFeedback& more) {
    constraints.insert(constraints.end(), more.constraints.begin(), more.constraints.end());
    qualities.insert(qualities.end(), more.qualities.begin(), more.qualities.end());
  }
};

}  // namespace mono3d
