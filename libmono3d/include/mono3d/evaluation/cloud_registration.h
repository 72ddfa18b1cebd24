// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

// Nothing here is a length: the options hold for a world of any scale.
struct CloudRegistrationOptions {
  int max_points = 50000;                // of the estimate that take part, spread evenly in space
  int max_iterations = 60;               // of each of the two passes
  double max_distance_in_quartiles = 5;  // pairs further apart than so many first quartiles of the
                                         // distances do not count
  double max_normal_angle_deg = 60.0;    // between normals of a pair, where both clouds have some
  int num_normal_neighbours = 12;        // points to fit the truth's normals to
  double min_stiffness = 1e-4;  // relative to the stiffest; see CloudRegistration::num_free_motions

  void Visit(OptionVisitor& visit);
  // Throws UsageError.
  void Validate() const;
};

enum class CloudRegistrationStatus {
  kConverged,
  kNotConverged,  // the last iteration still moved the estimate
  kNoOverlap,     // hardly a point has a counterpart
};

const char* ToString(CloudRegistrationStatus status);

struct CloudRegistration {
  CloudRegistrationStatus status = CloudRegistrationStatus::kNoOverlap;
  std::string reason;           // one line; empty when converged
  Similarity S_truth_estimate;  // maps the estimate onto the truth; the start with kNoOverlap
  int num_iterations = 0;
  double residual_m = 0;        // RMSE point to plane over the inliers, unit of the truth
  double inlier_share = 0;      // of the points taking part: those paired in the last iteration
  std::int64_t num_points = 0;  // of the estimate that took part
  int num_free_motions = 0;     // how many independent motions no surface resists (1 slides along a
                                // trench, 3 a plane; the scale of ground with less relief than ten
                                // times the noise): along these the start is kept

  bool converged() const { return status == CloudRegistrationStatus::kConverged; }
};

// Point-to-plane ICP (Chen and Medioni 1992) of `estimate` onto `truth` from the start
// `S_truth_estimate`: each point of the estimate is drawn to the plane through its nearest
// neighbour in the truth. RegisterCloudRigidly keeps the start's scale (6 motions), RegisterCloud
// finds it as well (7). First with an eighth of the points, then with all that take part. The
// overlap may be partial: pairs much further apart than the closer ones do not count, and the
// weight of the others falls to 0 at that limit (Tukey's weights). The same input gives the same
// result. Normals of the truth are fitted when it has none; those of the estimate are used when
// they are there. Throws Error when a cloud is empty, holds a coordinate that is not finite, lists
// of differing lengths or, the truth, fewer than three points.
CloudRegistration RegisterCloudRigidly(const PointCloud& estimate, const PointCloud& truth,
                                       const Similarity& S_truth_estimate,
                                       const CloudRegistrationOptions& options = {});
CloudRegistration RegisterCloud(const PointCloud& estimate, const PointCloud& truth,
                                const Similarity& S_truth_estimate,
                                const CloudRegistrationOptions& options = {});

}  // namespace mono3d
