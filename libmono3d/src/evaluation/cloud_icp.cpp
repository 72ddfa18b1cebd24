// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/cloud_icp.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "evaluation/cloud_sampling.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr int kCoarseShare = 8;            // the first pass has one point in so many
constexpr double kCoarseTolerance = 1e-4;  // motion that ends a pass, over the cloud's radius
constexpr double kFineTolerance = 1e-5;    // below it pairs may change for ever, to and fro
constexpr double kMaxOffset = 0.1;     // first quartile of the distances over the truth's radius
constexpr std::size_t kMinPairs = 12;  // some more than the seven unknowns

// A point of the estimate in the truth's frame, and the plane that it is drawn to.
struct Pair {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
  double residual;  // signed distance to the plane
};

struct Step {
  Similarity motion;    // to apply after the current similarity
  double size = 0;      // of the motion, over the radius of the pairs
  double residual = 0;  // RMSE point to plane before it, weighted
  int num_free_motions = 0;
};

double Radius(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  const Eigen::Vector3d centre = sum / static_cast<double>(points.size());
  double sum_of_squares = 0;
  for (const Eigen::Vector3d& point : points) sum_of_squares += (point - centre).squaredNorm();
  return std::sqrt(sum_of_squares / static_cast<double>(points.size()));
}

struct Pairs {
  std::vector<Pair> list;  // those that count; empty when the clouds do not lie on each other
  double max_distance = 0;
};

Pairs FindPairs(const IcpPoints& estimate, const CloudSurface& truth, double truth_radius,
                const Similarity& S_truth_estimate, double max_distance_in_quartiles,
                const CloudRegistrationOptions& options) {
  const std::size_t size = estimate.points.size();
  std::vector<Eigen::Vector3d> points(size);
  std::ranges::transform(estimate.points, points.begin(),
                         [&](const Eigen::Vector3d& p) { return S_truth_estimate * p; });
  const std::vector<std::uint32_t> nearest = truth.Nearest(points);
  std::vector<double> distances(size);
  for (std::size_t i = 0; i < size; ++i) {
    distances[i] = (points[i] - truth.points()[nearest[i]]).norm();
  }
  const double quartile = Quantile(distances, 0.25);
  if (!(quartile <= kMaxOffset * truth_radius)) return {};
  const double max_distance = max_distance_in_quartiles * quartile;

  const Eigen::Quaterniond& R_truth_estimate = S_truth_estimate.pose().rotation();
  const double min_cosine = std::cos(options.max_normal_angle_deg * std::numbers::pi / 180);
  Pairs pairs{{}, max_distance};
  for (std::size_t i = 0; i < size; ++i) {
    if (distances[i] > max_distance) continue;
    const Eigen::Vector3d normal = truth.normals()[nearest[i]].cast<double>();
    if (normal.isZero()) continue;
    if (!estimate.normals.empty()) {
      const double cosine = normal.dot(R_truth_estimate * estimate.normals[i].cast<double>());
      if ((truth.has_outward_normals() ? cosine : std::abs(cosine)) < min_cosine) continue;
    }
    pairs.list.push_back({points[i], normal, normal.dot(points[i] - truth.points()[nearest[i]])});
  }
  return pairs;
}

// Tukey's weights, which fall to 0 at the limit to pairs. Not at a share of the residuals' own
// spread: where most points lie in one plane that is next to nothing, and all others would be cast
// out.
std::vector<double> TukeyWeights(const Pairs& pairs) {
  std::vector<double> weights(pairs.list.size(), 1.0);
  if (!(pairs.max_distance > 0)) return weights;  // a quarter of the points lies on the truth's
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double ratio = std::min(1.0, std::abs(pairs.list[i].residual) / pairs.max_distance);
    weights[i] = (1 - ratio * ratio) * (1 - ratio * ratio);
  }
  return weights;
}

// Does the relief stand out from the noise? Almost flat ground tells no scale. `sum_of_squares`: of
// the residuals, of which the noise is what no motion takes away.
bool TellsScale(const Matrix7& stiffness, const Vector7& force, double sum_of_squares) {
  constexpr double kMaxNoise = 0.01;  // of the relief's square: a tenth of it
  const double noise =
      sum_of_squares - force.dot(stiffness.completeOrthogonalDecomposition().solve(force));
  const Eigen::Vector<double, 6> with_others = stiffness.topRightCorner<6, 1>();
  const double relief =
      stiffness(6, 6) -
      with_others.dot(
          stiffness.topLeftCorner<6, 6>().completeOrthogonalDecomposition().solve(with_others));
  return noise < kMaxNoise * relief;
}

// Gauss-Newton on the weighted sum of squared residuals, around the pairs' centre. The unknowns are
// made lengths over the pairs' radius: rotation, translation and, with seven, scale. By the scale a
// point of the truth moves, not that of the estimate: that one's noise would be taken for relief,
// which a smaller scale makes smaller, each time again, until all lies in one point. Motions that
// the planes do not resist stay out.
Step SolveStep(const Pairs& all_pairs, bool with_scale, double min_stiffness) {
  const std::vector<double> weights = TukeyWeights(all_pairs);
  const std::vector<Pair>& pairs = all_pairs.list;
  std::vector<Eigen::Vector3d> points(pairs.size());
  std::ranges::transform(pairs, points.begin(), [](const Pair& pair) { return pair.point; });
  const double radius = Radius(points);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) centre += point;
  centre /= static_cast<double>(points.size());

  Matrix7 stiffness = Matrix7::Zero();
  Vector7 force = Vector7::Zero();
  double sum_of_weights = 0;
  double sum_of_squares = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d offset = (pairs[i].point - centre) / radius;
    const double residual = pairs[i].residual / radius;
    Vector7 row;
    row << offset.cross(pairs[i].normal), pairs[i].normal,
        with_scale ? pairs[i].normal.dot(offset) - residual : 0.0;
    stiffness.noalias() += weights[i] * row * row.transpose();
    force -= weights[i] * residual * row;
    sum_of_weights += weights[i];
    sum_of_squares += weights[i] * residual * residual;
  }
  if (with_scale && !TellsScale(stiffness, force, sum_of_squares)) {
    stiffness.row(6).setZero();
    stiffness.col(6).setZero();
    force[6] = 0;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix7> solver(stiffness);
  Vector7 motion = Vector7::Zero();
  Step step;
  for (int i = 0; i < 7; ++i) {
    if (solver.eigenvalues()[i] > min_stiffness * solver.eigenvalues()[6]) {
      const Vector7 direction = solver.eigenvectors().col(i);
      motion += direction * (direction.dot(force) / solver.eigenvalues()[i]);
    } else {
      ++step.num_free_motions;
    }
  }
  if (!with_scale) --step.num_free_motions;  // the scale itself, held on purpose

  const double scale = std::exp(motion[6]);
  const Eigen::Quaterniond rotation = RotationExp(motion.head<3>());
  const Eigen::Vector3d translation =
      centre + radius * motion.segment<3>(3) - rotation * (scale * centre);
  step.motion = Similarity(scale, Pose(rotation, translation));
  step.size = motion.norm();
  step.residual = radius * std::sqrt(sum_of_squares / sum_of_weights);
  return step;
}

// One pass of ICP from registration.S_truth_estimate on; false when pairs are missing.
bool RunPass(const IcpPoints& estimate, const CloudSurface& truth, double truth_radius,
             bool with_scale, double tolerance, const CloudRegistrationOptions& options,
             CloudRegistration& registration) {
  registration.status = CloudRegistrationStatus::kNotConverged;
  registration.num_points = static_cast<std::int64_t>(estimate.points.size());
  for (int i = 0; i < options.max_iterations; ++i) {
    const Pairs pairs = FindPairs(estimate, truth, truth_radius, registration.S_truth_estimate,
                                  options.max_distance_in_quartiles, options);
    registration.inlier_share =
        static_cast<double>(pairs.list.size()) / static_cast<double>(estimate.points.size());
    if (pairs.list.size() < kMinPairs) return false;
    const Step step = SolveStep(pairs, with_scale, options.min_stiffness);
    registration.S_truth_estimate = step.motion * registration.S_truth_estimate;
    registration.residual_m = step.residual;
    registration.num_free_motions = step.num_free_motions;
    ++registration.num_iterations;
    if (step.size < tolerance) {
      registration.status = CloudRegistrationStatus::kConverged;
      return true;
    }
  }
  return true;
}

IcpPoints Thinned(const IcpPoints& all) {
  const std::vector<std::uint32_t> chosen =
      SampleEvenly(all.points, std::max(kMinPairs, all.points.size() / kCoarseShare));
  IcpPoints thinned;
  for (const std::uint32_t i : chosen) {
    thinned.points.push_back(all.points[i]);
    if (!all.normals.empty()) thinned.normals.push_back(all.normals[i]);
  }
  return thinned;
}

}  // namespace

IcpPoints ChooseIcpPoints(const PointCloud& estimate, int max_points) {
  const std::vector<Eigen::Vector3d> points = CloudPoints(estimate);
  IcpPoints chosen;
  for (const std::uint32_t i : SampleEvenly(points, static_cast<std::size_t>(max_points))) {
    chosen.points.push_back(points[i]);
    if (!estimate.normals.empty()) chosen.normals.push_back(estimate.normals[i].normalized());
  }
  return chosen;
}

CloudRegistration RegisterPoints(const IcpPoints& estimate, const CloudSurface& truth,
                                 const Similarity& S_truth_estimate, bool with_scale,
                                 const CloudRegistrationOptions& options) {
  const double truth_radius = Radius(truth.points());
  CloudRegistration registration;
  registration.S_truth_estimate = S_truth_estimate;
  if (RunPass(Thinned(estimate), truth, truth_radius, with_scale, kCoarseTolerance, options,
              registration) &&
      RunPass(estimate, truth, truth_radius, with_scale, kFineTolerance, options, registration)) {
    if (!registration.converged()) {
      registration.reason = "still moving after " + std::to_string(options.max_iterations) +
                            " iterations with all points";
    }
    return registration;
  }
  registration.status = CloudRegistrationStatus::kNoOverlap;
  registration.S_truth_estimate = S_truth_estimate;
  std::ostringstream reason;
  reason << "the clouds do not lie on each other: " << 100 * registration.inlier_share << " % of "
         << registration.num_points << " points have a counterpart";
  registration.reason = reason.str();
  return registration;
}

}  // namespace mono3d
