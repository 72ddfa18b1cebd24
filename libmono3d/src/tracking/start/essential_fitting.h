// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/homography.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {

// An essential matrix of norm 1, and what it leaves of each pair: Cauchy's loss of the Sampson
// distance (Hartley and Zisserman 2004, section 11.4.3), in standard deviations.
struct EpipolarFit {
  Eigen::Matrix3d essential;
  std::vector<double> losses;
};

// The essential matrices about which the pairs leave least, the best first; those that it is better
// than beyond chance are left out. A fundamental matrix and a homography have 7 and 8 unknowns
// where a motion has 5, so the motions nearest to them (`guesses`) are off by what the others took
// up, and there are others: of a camera that moves ahead by little, a shift to the side of a scene
// that lies aslant explains the pairs nearly as well (Oliensis 2005). So the search begins from
// directions all around too. Pixels are free of distortion, `sigma_px` their standard deviation.
// Empty for fewer than 8 pairs.
std::vector<EpipolarFit> FitEssentials(std::span<const Pose> guesses,
                                       std::span<const PointPair> pairs, const CameraModel& camera,
                                       double sigma_px);

// What one motion leaves of each pair, in the same measure. Its translation is not zero.
std::vector<double> EpipolarLosses(const Pose& T_b_a, std::span<const PointPair> pairs,
                                   const CameraModel& camera, double sigma_px);

}  // namespace mono3d::tracking
