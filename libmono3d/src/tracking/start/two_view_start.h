// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/features/matching.h"

namespace mono3d::tracking {

// Pyramid levels of the features of a start, from 0: the corners of coarser ones, 2.07 px and
// more in the full image, are too vague.
inline constexpr int kMaxStartLevel = 3;

// The motion between two views and the points they share, in the frame of camera a; the length of
// the translation is arbitrary.
struct TwoViewStart {
  Pose T_b_a;
  std::vector<FeatureMatch> matches;
  std::vector<Eigen::Vector3d> p_a;  // of each match
  bool is_planar = false;            // explained by a homography
  bool is_adjusted = false;          // motion and points fit further views between the two as well
};

// The motions that two views leave open, the one with most points first.
struct StartAttempt {
  std::vector<TwoViewStart> candidates;  // one where it is clear, more where it is not
  // Motions over a plane that these two views speak against: near the plane many motions have
  // nearly the same epipolar lines, so further views may show that one of them is right after all.
  std::vector<TwoViewStart> unlikely;
  std::string reason;  // why there is no candidate
  // Those that the motion explains which has too little parallax for a start.
  int num_without_parallax = 0;
  // The motions are over a plane, and a turn on the spot leaves less than twice the noise: with a
  // longer way they will be surer.
  bool is_near_turn = false;
};

// Homography and fundamental matrix in competition, then the motions among their decompositions
// that have the points in front of both cameras. Both motions over a plane may: then a third view
// must tell them apart.
StartAttempt StartFromTwoViews(const View& a, const View& b,
                               const std::vector<FeatureMatch>& matches, const CameraModel& camera,
                               const InitialisationOptions& options, int seed);

}  // namespace mono3d::tracking
