// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "tracking/positions/positioned_path.h"

namespace mono3d::tracking {

// How well the positions of a path agree with a drift and errors of given sizes.
struct DriftLikelihood {
  double log_likelihood = 0;
  std::vector<char> is_outlier;  // of each position
};

// A Kalman filter along the path. Its state is by how much a keyframe is off (a small similarity of
// the world about the middle of the path), which each edge to the next keyframe makes less certain,
// by how much the positions are off, which wanders, and by how much their times are, which stays.
// Known points have no part of these two. Whatever
// the size of the drift, the start is unknown. A position that no plausible state explains is an
// outlier, of which one in a hundred is expected anywhere. Only the edges from each keyframe to the
// next count: O(path + positions).
class DriftFilter {
 public:
  // Linearises at the path as it is; the path must outlive it.
  explicit DriftFilter(const PositionedPath& path);

  // These count as outliers from now on, whatever the state.
  void LeaveOut(const std::vector<char>& is_left_out) { is_left_out_ = is_left_out; }

  DriftLikelihood Run(const PathNoise& noise) const;

 private:
  // Translation, rotation, log scale, wander, clock offset.
  using State = Eigen::Matrix<double, 11, 1>;
  using Covariance = Eigen::Matrix<double, 11, 11>;

  struct Step {  // from the keyframe before
    Eigen::Matrix<double, 7, 1> offset;
    Eigen::Vector3d centre_m;  // of the keyframe, from the middle of the path
  };
  struct Residual {
    Eigen::Vector3d arm_m;  // from the middle of the path
    Eigen::Vector3d r_m;    // measured minus expected
    Eigen::Vector3d velocity_m_per_s;
  };

  void AddDrift(const Step& step, const PathNoise& noise, State& state,
                Covariance& covariance) const;

  const PositionedPath& path_;
  std::vector<Step> steps_;
  std::vector<Residual> residuals_;
  std::vector<char> is_left_out_;  // of each position
  double shift_m_ = 0;             // that of the path, in metres
};

}  // namespace mono3d::tracking
