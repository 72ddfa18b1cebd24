// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/pose.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d::tracking {

// What is known when the question comes up.
struct InsertionEvidence {
  Pose T_current_last;            // from the newest keyframe to the current frame
  Pose T_current_previous;        // from the frame before
  double median_depth_su = 0;     // of the current frame
  int num_inliers = 0;            // of the current frame
  int num_reference_points = 0;   // of the reference keyframe
  bool is_last_previous = false;  // the newest keyframe is the frame before
  bool is_young = false;          // too few keyframes, or too little depth, to rely on the points
  // Among the frames from the newest keyframe on (SharpnessHistory).
  bool is_blurred = false;
  bool is_sharp = false;
};

// Does the current frame bear enough new content to become a keyframe? A blurred one waits for a
// sharper one as long as the distance allows, a sharp one among blurred ones becomes one early.
bool NeedsKeyframe(const InsertionEvidence& evidence, const KeyframeInsertionOptions& options);

}  // namespace mono3d::tracking
