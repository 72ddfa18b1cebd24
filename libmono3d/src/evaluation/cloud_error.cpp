// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_error.h"

#include <algorithm>
#include <cmath>

#include "evaluation/cloud_distances.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"

namespace mono3d {
namespace {

constexpr int kNormalNeighbours = 12;
constexpr double kMaxSpacingsBeside = 2;  // from the point that a plane goes through

struct Distances {
  std::vector<double> to_point;
  std::vector<double> to_plane;
};

// From each of `points` to `surface`, in the unit of `surface`.
Distances MeasureDistances(std::span<const Eigen::Vector3d> points, const CloudSurface& surface) {
  const std::vector<std::uint32_t> nearest = surface.Nearest(points);
  Distances distances{std::vector<double>(points.size()), std::vector<double>(points.size())};
  const double max_beside = kMaxSpacingsBeside * surface.spacing();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d offset = points[i] - surface.points()[nearest[i]];
    const Eigen::Vector3d normal = surface.normals()[nearest[i]].cast<double>();
    const double along = normal.dot(offset);
    const bool beside = (offset - along * normal).norm() > max_beside || normal.isZero();
    distances.to_point[i] = offset.norm();
    distances.to_plane[i] = beside ? offset.norm() : std::abs(along);
  }
  return distances;
}

std::vector<Eigen::Vector3d> Transformed(const Similarity& S_a_b,
                                         std::span<const Eigen::Vector3d> points_b) {
  std::vector<Eigen::Vector3d> points_a(points_b.size());
  std::ranges::transform(points_b, points_a.begin(),
                         [&](const Eigen::Vector3d& point) { return S_a_b * point; });
  return points_a;
}

void Scale(double factor, std::vector<double>& lengths) {
  for (double& length : lengths) length *= factor;
}

double ShareWithin(double threshold, std::span<const double> distances) {
  const auto within = std::ranges::count_if(distances, [&](double d) { return d <= threshold; });
  return static_cast<double>(within) / static_cast<double>(distances.size());
}

double HarmonicMean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

void RequireThresholds(std::span<const double> thresholds_m) {
  for (const double threshold : thresholds_m) {
    if (std::isfinite(threshold) && threshold > 0) continue;
    throw UsageError(ErrorParts{"a distance to count points within is not positive",
                                "cloud thresholds", "more than 0", std::to_string(threshold)});
  }
}

CloudShares ComputeShares(double threshold_m, const Distances& of_estimate,
                          const Distances& of_truth) {
  CloudShares shares;
  shares.threshold_m = threshold_m;
  shares.accuracy = ShareWithin(threshold_m, of_estimate.to_point);
  shares.completeness = ShareWithin(threshold_m, of_truth.to_point);
  shares.f_score = HarmonicMean(shares.accuracy, shares.completeness);
  shares.accuracy_to_plane = ShareWithin(threshold_m, of_estimate.to_plane);
  shares.completeness_to_plane = ShareWithin(threshold_m, of_truth.to_plane);
  shares.f_score_to_plane = HarmonicMean(shares.accuracy_to_plane, shares.completeness_to_plane);
  return shares;
}

}  // namespace

std::vector<double> CloudThresholds(double mean_depth_m) {
  if (!std::isfinite(mean_depth_m) || !(mean_depth_m > 0)) {
    throw UsageError(ErrorParts{"the mean depth is not positive", "mean depth", "more than 0",
                                std::to_string(mean_depth_m)});
  }
  return {0.005 * mean_depth_m, 0.01 * mean_depth_m, 0.02 * mean_depth_m};
}

CloudError ComputeCloudError(const CloudSurface& estimate, const Similarity& S_truth_estimate,
                             const CloudSurface& truth, std::span<const double> thresholds_m) {
  RequireThresholds(thresholds_m);
  Distances of_estimate = MeasureDistances(Transformed(S_truth_estimate, estimate.points()), truth);
  Distances of_truth =
      MeasureDistances(Transformed(S_truth_estimate.Inverse(), truth.points()), estimate);
  Scale(S_truth_estimate.scale(), of_truth.to_point);
  Scale(S_truth_estimate.scale(), of_truth.to_plane);

  CloudError error;
  error.estimate_to_truth = ComputeStatistics(of_estimate.to_point);
  error.truth_to_estimate = ComputeStatistics(of_truth.to_point);
  error.estimate_to_truth_plane = ComputeStatistics(of_estimate.to_plane);
  error.truth_to_estimate_plane = ComputeStatistics(of_truth.to_plane);
  error.estimate_spacing_m = S_truth_estimate.scale() * estimate.spacing();
  error.truth_spacing_m = truth.spacing();
  for (const double threshold : thresholds_m) {
    error.shares.push_back(ComputeShares(threshold, of_estimate, of_truth));
  }
  error.estimate_distances_m = std::move(of_estimate.to_point);
  error.estimate_plane_distances_m = std::move(of_estimate.to_plane);
  error.truth_distances_m = std::move(of_truth.to_point);
  return error;
}

CloudError ComputeCloudError(const PointCloud& estimate, const PointCloud& truth,
                             std::span<const double> thresholds_m) {
  RequireThresholds(thresholds_m);
  CheckCloud(estimate, "estimate");
  CheckCloud(truth, "truth");
  return ComputeCloudError(CloudSurface(estimate, kNormalNeighbours), Similarity(),
                           CloudSurface(truth, kNormalNeighbours), thresholds_m);
}

}  // namespace mono3d
