// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/evaluation/error_statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/geometry/stamped_pose.h"

namespace MONO3D_EXPORT mono3d {

struct TrajectoryErrorOptions {
  std::string align = "sim3";           // "sim3", "se3" or "none"
  double max_time_difference_s = 0.01;  // of two poses that count as simultaneous
  // Length of the segments for the relative error, as a share of the truth's associated path.
  double relative_segment = 0.1;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// An estimated pose beside the true one of the same time.
struct AssociatedPose {
  std::size_t estimate_index = 0;  // in the lists as given
  std::size_t truth_index = 0;
  double timestamp_s = 0;      // of the truth
  Pose T_truth_cam_estimated;  // after the alignment, in the truth's frame and unit
  Pose T_truth_cam;
  double position_error = 0;  // distance, in the truth's unit
  double rotation_error_deg = 0;
};

struct TrajectoryError {
  Similarity S_truth_estimate;        // the alignment; identity for "none"
  std::vector<AssociatedPose> poses;  // in order of time
  std::int64_t num_estimated = 0;     // poses given
  std::int64_t num_true = 0;          // poses given
  double truth_coverage = 0;          // share of the true poses that have an estimate, 0 to 1
  double path_length = 0;             // of the whole truth, in its unit

  ErrorStatistics position;      // absolute pose error (APE) of the positions, truth's unit
  ErrorStatistics rotation_deg;  // absolute pose error of the rotations
  // Relative pose error over segments of the path: error of the motion by the length of the path,
  // a share (metres per metre), and degrees per unit of path. Empty (count 0) when the camera
  // stands still.
  ErrorStatistics relative_position;
  ErrorStatistics relative_rotation_deg;
  // Do the true positions lie on a line, as far as position errors let one see (extent across below
  // a thousandth of that along; or below a twentieth, and errors above a thirtieth of the extent
  // across, or else such that the positions tell less about the rotation about the line than the
  // orientations do, and agree with them)? Then the alignment takes it from the orientations.
  bool is_straight = false;
};

// The error of an estimated trajectory, by the conventions of evo (Grupp 2017; Umeyama 1991;
// relative errors after Geiger et al. 2012, with segments that scale with the path).
//
// Each pose of the shorter list takes the pose of the other that is nearest in time, if the
// difference is at most max_time_difference_s; of several that take the same one the nearest
// keeps it. The lists may be in any order of time. The alignment minimises the squared distances
// of the associated positions; the errors are those of the associated poses.
//
// Throws Error when fewer than three poses are associated (for "none": fewer than one), and, unless
// the alignment is "none", when all positions of either side are in one place.
TrajectoryError CompareTrajectories(std::span<const StampedPose> estimate,
                                    std::span<const StampedPose> truth,
                                    const TrajectoryErrorOptions& options = {});

}  // namespace mono3d
