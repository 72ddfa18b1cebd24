// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/keyframe_insertion.h"

#include <numbers>

namespace mono3d::tracking {
namespace {

// Are the limits reached, when the camera may go `reach` times as far as the options say?
bool IsAtLimits(const InsertionEvidence& evidence, const KeyframeInsertionOptions& options,
                double reach) {
  const auto degrees = [](const Pose& pose) {
    return pose.RotationAngle() * 180 / std::numbers::pi;
  };
  const auto baseline_share = [&](const Pose& pose) {
    return pose.Inverse().translation().norm() / evidence.median_depth_su;
  };
  // The next frame would be too far from the newest keyframe.
  const double rotation = degrees(evidence.T_current_last);
  const double baseline = baseline_share(evidence.T_current_last);
  // Where every image would be one, a little more spares every second: 4.8 degrees by default, of
  // the 5 that a bundle may have between neighbours.
  constexpr double kTolerance = 1.2;
  const double tolerance = reach * (evidence.is_last_previous ? kTolerance : 1);
  if (rotation + degrees(evidence.T_current_previous) > tolerance * options.max_rotation_deg) {
    return true;
  }
  if (baseline + baseline_share(evidence.T_current_previous) >
      tolerance * options.max_baseline_share) {
    return true;
  }
  // Points from two views with little parallax are vague; more views make a map of them.
  if (evidence.is_young && baseline >= reach * options.min_baseline_share) return true;
  const double tracked_share =
      evidence.num_reference_points > 0
          ? static_cast<double>(evidence.num_inliers) / evidence.num_reference_points
          : 0;
  if (baseline >= reach * options.min_baseline_share &&
      1 - tracked_share > reach * (1 - options.min_tracked_share)) {
    return true;
  }
  // Half of the points gone: tracking itself needs new ones, if there is any baseline to find them.
  return tracked_share < 0.5 * options.min_tracked_share &&
         baseline >= 0.5 * options.min_baseline_share;
}

}  // namespace

bool NeedsKeyframe(const InsertionEvidence& evidence, const KeyframeInsertionOptions& options) {
  if (evidence.num_inliers < options.min_inliers || evidence.median_depth_su <= 0) return false;
  // A swing of the camera by hand or wind, 1 to 4 Hz, is sharp where it turns, twice a period: half
  // as far again as the camera goes between two keyframes is time enough to meet one of its turns.
  constexpr double kPatience = 1.5;
  double reach = 1;
  if (evidence.is_blurred) reach = kPatience;
  if (evidence.is_sharp) reach = 1 / kPatience;
  return IsAtLimits(evidence, options, reach);
}

}  // namespace mono3d::tracking
