// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// The direction in which a camera sees a point.
struct SightLine {
  Pose T_world_cam;
  Eigen::Vector3d ray_cam = Eigen::Vector3d::UnitZ();  // at z = 1, free of distortion
  double sigma = 0;  // standard deviation at z = 1, of x and of y; more than 0
};

// Where several lines of sight meet.
struct SightLineMeeting {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // by the sigmas of the lines
  std::vector<char> is_outlier;                          // of each line
};

enum class SightLineProblem {
  kNone,
  kTooFew,        // fewer than two lines
  kNoParallax,    // from one place: less than `min_parallax_rad` between any two of them
  kContradiction  // no point that more than half of them, and two or more, agree on
};

struct SightLineResult {
  std::optional<SightLineMeeting> meeting;
  SightLineProblem problem = SightLineProblem::kNone;  // why there is none
};

// The point that most lines agree on, each within `gate` of its standard deviations (first by pairs
// of them, then by least squares over those that agree). Of two lines that do not meet none is
// believed. O(n^3) up to 12 lines; of more, pairs among some of them are tried.
SightLineResult MeetSightLines(std::span<const SightLine> lines, double min_parallax_rad,
                               double gate);

// How far a point is from where a camera sees it, at z = 1; nothing behind the camera.
std::optional<Eigen::Vector2d> SightLineError(const SightLine& line,
                                              const Eigen::Vector3d& p_world);

}  // namespace mono3d
