// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/trajectory_alignment.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Less spread than this share of the distance from the origin is rounding, not motion.
constexpr double kMinSpread = 1e-9;
// Extent across by extent along: under the first a path is straight, over the second it is not.
constexpr double kStraight = 1e-3;
constexpr double kBent = 0.05;
// In between, position errors of this share of the extent across turn the alignment about the line
// by some two degrees: more than orientations err.
constexpr double kLooseTurn_rad = 1.0 / 30;

Eigen::Matrix3Xd Positions(std::span<const Pose> poses) {
  Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    positions.col(static_cast<Eigen::Index>(i)) = poses[i].translation();
  }
  return positions;
}

std::vector<Eigen::Vector3d> Points(std::span<const Pose> poses) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(poses.size());
  for (const Pose& pose : poses) points.push_back(pose.translation());
  return points;
}

// How positions spread around their mean.
struct Spread {
  Eigen::Vector3d mean;
  Eigen::Vector3d direction;  // of the largest extent
  double along = 0;           // standard deviation along it
  double across = 0;          // the next smaller one
};

Spread SpreadOf(std::span<const Pose> poses, const char* side) {
  const Eigen::Matrix3Xd positions = Positions(poses);
  Spread spread;
  spread.mean = positions.rowwise().mean();
  const Eigen::Matrix3Xd centred = positions.colwise() - spread.mean;
  const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(centred, Eigen::ComputeThinU);
  const double root_of_count = std::sqrt(static_cast<double>(poses.size()));
  spread.direction = svd.matrixU().col(0);
  spread.along = svd.singularValues()(0) / root_of_count;
  spread.across = svd.singularValues()(1) / root_of_count;
  if (!(spread.along > kMinSpread * spread.mean.norm())) {
    throw Error(ErrorParts{.what = "cannot align trajectories",
                           .where = {},
                           .expected = "a camera that moves",
                           .found = std::string(side) + " positions all in one place"});
  }
  return spread;
}

// The turn about `axis` that brings the estimated orientations closest to the true ones: it
// maximises the sum of trace(R_truth^T * turn * R * R_estimate).
Eigen::Quaterniond TurnFromOrientations(std::span<const Pose> estimate, std::span<const Pose> truth,
                                        const Eigen::Quaterniond& R_truth_estimate,
                                        const Eigen::Vector3d& axis) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    sum += (R_truth_estimate * estimate[i].rotation() * truth[i].rotation().conjugate())
               .toRotationMatrix();
  }
  // trace(turn(angle) * sum) = cos(angle) * even + sin(angle) * odd + a constant.
  const double even = sum.trace() - axis.dot(sum * axis);
  const Eigen::Vector3d skew(sum(1, 2) - sum(2, 1), sum(2, 0) - sum(0, 2), sum(0, 1) - sum(1, 0));
  return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(axis.dot(skew), even), axis));
}

double RootMeanSquareError(const Similarity& S_truth_estimate, std::span<const Pose> estimate,
                           std::span<const Pose> truth) {
  double sum = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    sum += (S_truth_estimate * estimate[i].translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

// By how much the orientations scatter about the line under an alignment.
double ScatterAboutAxis(std::span<const Pose> estimate, std::span<const Pose> truth,
                        const Eigen::Quaterniond& R_truth_estimate, const Eigen::Vector3d& axis) {
  double sum = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Quaterniond left =
        R_truth_estimate * estimate[i].rotation() * truth[i].rotation().conjugate();
    sum += std::pow(axis.dot(RotationLog(left)), 2);
  }
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

// Do the positions leave the turn about their line open, or know less of it than the orientations,
// which do not contradict them? `turn`: what the orientations ask for.
bool IsStraight(const Spread& truth, double position_error, double turn_rad, double scatter_rad) {
  constexpr double kMaxSigmas = 3;
  if (truth.across < kStraight * truth.along) return true;
  if (truth.across >= kBent * truth.along) return false;
  const double loose_rad = position_error / truth.across;
  if (loose_rad > kLooseTurn_rad) return true;
  return scatter_rad < loose_rad && turn_rad < kMaxSigmas * loose_rad;
}

}  // namespace

TrajectoryAlignment AlignTrajectory(std::span<const Pose> estimate, std::span<const Pose> truth,
                                    bool with_scale) {
  const Spread from = SpreadOf(estimate, "estimated");
  const Spread to = SpreadOf(truth, "true");
  const Similarity fit = FitSimilarity(Points(estimate), Points(truth));
  Eigen::Quaterniond rotation = fit.pose().rotation();
  const Eigen::Quaterniond turn = TurnFromOrientations(estimate, truth, rotation, to.direction);
  const bool is_straight =
      IsStraight(to, RootMeanSquareError(fit, estimate, truth),
                 turn.angularDistance(Eigen::Quaterniond::Identity()),
                 ScatterAboutAxis(estimate, truth, turn * rotation, to.direction));
  if (is_straight) rotation = turn * rotation;
  // Umeyama's rotation is the same with and without scale, and the means are brought together.
  const double scale = with_scale ? fit.scale() : 1;
  return {Similarity(scale, Pose(rotation, to.mean - scale * (rotation * from.mean))), is_straight};
}

}  // namespace mono3d
