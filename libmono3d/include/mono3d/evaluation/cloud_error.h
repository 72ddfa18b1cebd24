// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/evaluation/error_statistics.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// How much of two clouds lies within a distance of the other (Knapitsch et al. 2017).
struct CloudShares {
  double threshold_m = 0;
  double accuracy = 0;      // share of the estimate within the threshold of the truth, 0 to 1
  double completeness = 0;  // share of the truth within the threshold of the estimate, 0 to 1
  double f_score = 0;       // harmonic mean of the two; 0 when both are
  // The same by point-to-plane distances.
  double accuracy_to_plane = 0;
  double completeness_to_plane = 0;
  double f_score_to_plane = 0;
};

// Distances between two clouds in one frame, in the unit of the clouds, written _m. Every point of
// a cloud counts once.
struct CloudError {
  // From each point to the nearest point of the other cloud; never below 0. The other cloud's
  // spacing is a floor: a perfect estimate still measures about half of it.
  ErrorStatistics estimate_to_truth;
  ErrorStatistics truth_to_estimate;
  // From each point to the plane through the nearest point of the other cloud, where it lies beside
  // that point by no more than two spacings of the other cloud; elsewhere, past a border or a
  // hole, the distance to the point. This has no floor.
  ErrorStatistics estimate_to_truth_plane;
  ErrorStatistics truth_to_estimate_plane;
  // Median distance of a point to its nearest neighbour in the same cloud.
  double estimate_spacing_m = 0;
  double truth_spacing_m = 0;
  // One per threshold, in the order given.
  std::vector<CloudShares> shares;
  // The distances behind estimate_to_truth and estimate_to_truth_plane, in the estimate's order.
  std::vector<double> estimate_distances_m;
  std::vector<double> estimate_plane_distances_m;
  std::vector<double> truth_distances_m;  // behind truth_to_estimate, in the truth's order
};

// The thresholds 0.5 %, 1 % and 2 % of the mean depth. Throws UsageError unless it is positive.
std::vector<double> CloudThresholds(double mean_depth_m);

// Nearest neighbours are exact. Normals of the planes are those of the clouds, or fitted to 12
// neighbours where a cloud has none.
// Throws Error when a cloud is empty, holds a coordinate that is not finite or lists of differing
// lengths, UsageError when a threshold is not positive.
CloudError ComputeCloudError(const PointCloud& estimate, const PointCloud& truth,
                             std::span<const double> thresholds_m);

}  // namespace mono3d
