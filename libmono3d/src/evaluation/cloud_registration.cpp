// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_registration.h"

#include "evaluation/cloud_icp.h"
#include "evaluation/cloud_surface.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::size_t kMinTruthPoints = 3;  // of a plane

CloudRegistration Register(const PointCloud& estimate, const PointCloud& truth,
                           const Similarity& S_truth_estimate, bool with_scale,
                           const CloudRegistrationOptions& options) {
  options.Validate();
  CheckCloud(estimate, "estimate");
  CheckCloud(truth, "truth");
  if (truth.size() < kMinTruthPoints) {
    throw Error(ErrorParts{"too few points to register onto", "truth", "3 or more",
                           std::to_string(truth.size())});
  }
  return RegisterPoints(ChooseIcpPoints(estimate, options.max_points),
                        CloudSurface(truth, options.num_normal_neighbours), S_truth_estimate,
                        with_scale, options);
}

}  // namespace

const char* ToString(CloudRegistrationStatus status) {
  switch (status) {
    case CloudRegistrationStatus::kConverged:
      return "converged";
    case CloudRegistrationStatus::kNotConverged:
      return "not converged";
    case CloudRegistrationStatus::kNoOverlap:
      return "no overlap";
  }
  return "unknown";
}

void CloudRegistrationOptions::Visit(OptionVisitor& visit) {
  visit("max_points", max_points, "points of the estimate that take part");
  visit("max_iterations", max_iterations, "iterations of each of the two passes");
  visit("max_distance_in_quartiles", max_distance_in_quartiles,
        "pairs further apart than so many first quartiles of the distances do not count");
  visit("max_normal_angle_deg", max_normal_angle_deg, "largest angle between normals of a pair");
  visit("num_normal_neighbours", num_normal_neighbours, "points to fit a normal of the truth to");
  visit("min_stiffness", min_stiffness,
        "motions that the surfaces resist less than this share of the stiffest are not made");
}

void CloudRegistrationOptions::Validate() const {
  const auto require = [](bool holds, const char* option, const char* expected, double found) {
    RequireOption(holds, std::string("cloud.registration.") + option, expected, found);
  };
  require(max_points >= 100, "max_points", "100 or more", max_points);
  require(max_iterations >= 1, "max_iterations", "1 or more", max_iterations);
  require(max_distance_in_quartiles >= 1, "max_distance_in_quartiles", "1 or more",
          max_distance_in_quartiles);
  require(max_normal_angle_deg > 0 && max_normal_angle_deg <= 90, "max_normal_angle_deg",
          "more than 0, at most 90", max_normal_angle_deg);
  require(num_normal_neighbours >= 3, "num_normal_neighbours", "3 or more", num_normal_neighbours);
  require(min_stiffness >= 0 && min_stiffness < 1, "min_stiffness", "0 or more, less than 1",
          min_stiffness);
}

CloudRegistration RegisterCloudRigidly(const PointCloud& estimate, const PointCloud& truth,
                                       const Similarity& S_truth_estimate,
                                       const CloudRegistrationOptions& options) {
  return Register(estimate, truth, S_truth_estimate, false, options);
}

CloudRegistration RegisterCloud(const PointCloud& estimate, const PointCloud& truth,
                                const Similarity& S_truth_estimate,
                                const CloudRegistrationOptions& options) {
  return Register(estimate, truth, S_truth_estimate, true, options);
}

}  // namespace mono3d
