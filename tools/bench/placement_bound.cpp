// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/placement_bound.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <vector>

namespace mono3d::tools {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

// By how much the path is off from an axis of the positions, by each part of PlacementVector.
PlacementVector PlacementRow(const PathPoint& point, const Vector3d& middle_m, int axis) {
  const Vector3d arm_m = point.p_m - middle_m;
  PlacementVector row = PlacementVector::Zero();
  row[axis] = 1;
  for (int turn = 0; turn < 3; ++turn) row[3 + turn] = Vector3d::Unit(turn).cross(arm_m)[axis];
  row[6] = arm_m[axis];
  row[7] = point.velocity_m_per_s[axis];
  return row;
}

Eigen::MatrixXd CovarianceOf(const std::vector<double>& times_s, const PositionNoise& noise) {
  const auto size = static_cast<Index>(times_s.size());
  Eigen::MatrixXd covariance(size, size);
  for (Index i = 0; i < size; ++i) {
    for (Index k = 0; k <= i; ++k) {
      const double apart_s =
          times_s[static_cast<std::size_t>(i)] - times_s[static_cast<std::size_t>(k)];
      double value = i == k ? noise.white_m * noise.white_m : 0;
      if (noise.wander_m > 0) {
        value += noise.wander_m * noise.wander_m * std::exp(-apart_s / noise.correlation_s);
      }
      covariance(i, k) = covariance(k, i) = value;
    }
  }
  return covariance;
}

}  // namespace

PlacementBound::PlacementBound(std::span<const StampedPose> truth, const DrawnPositions& drawn,
                               const PositionNoise& noise, const PlacementKnowledge& knowledge) {
  Vector3d middle_m = Vector3d::Zero();
  for (const StampedPose& pose : truth) middle_m += pose.T_world_cam.translation();
  middle_m /= static_cast<double>(truth.size());
  std::vector<double> times_s;
  std::vector<std::size_t> fixes;
  for (std::size_t i = 0; i < drawn.true_times_s.size(); ++i) {
    if (drawn.is_outlier[i] != 0) continue;
    times_s.push_back(drawn.true_times_s[i]);
    fixes.push_back(i);
  }
  // The axes have one covariance, and are independent of each other.
  const Eigen::LLT<Eigen::MatrixXd> root(CovarianceOf(times_s, noise));
  PlacementMatrix information = PlacementMatrix::Zero();
  information(3, 3) = information(4, 4) = 1 / (knowledge.tilt_rad * knowledge.tilt_rad);
  information(7, 7) = 1 / (knowledge.clock_offset_s * knowledge.clock_offset_s);
  PlacementVector gradient = PlacementVector::Zero();
  // The offset is known to be about 0, and is not.
  gradient[7] = -drawn.clock_offset_s * information(7, 7);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixXd rows(static_cast<Index>(fixes.size()), 9);
    for (Index i = 0; i < rows.rows(); ++i) {
      const std::size_t fix = fixes[static_cast<std::size_t>(i)];
      rows.block<1, 8>(i, 0) =
          PlacementRow(PathAt(truth, drawn.true_times_s[fix]), middle_m, axis).transpose();
      rows(i, 8) = drawn.errors_m[fix][axis];
    }
    root.matrixL().solveInPlace(rows);
    information += rows.leftCols<8>().transpose() * rows.leftCols<8>();
    gradient += rows.leftCols<8>().transpose() * rows.col(8);
  }
  const Eigen::LDLT<PlacementMatrix> solver(information);
  covariance_ = solver.solve(PlacementMatrix::Identity());
  error_of_best_ = solver.solve(gradient);
}

}  // namespace mono3d::tools
