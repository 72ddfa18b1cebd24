// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>

#include "mono3d/core/export.h"
#include "mono3d/evaluation/cloud_error.h"
#include "mono3d/evaluation/cloud_registration.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

struct CloudEvaluation {
  CloudError error_at_start;     // after the first step alone
  CloudRegistration rigid;       // second step
  CloudRegistration with_scale;  // third step
  Similarity S_truth_estimate;   // after the last step that found enough pairs
  PointCloud estimate_in_truth;  // the estimate moved by it, for pictures
  CloudError error;              // the result
};

// The three steps of the paper: (1) `S_truth_estimate`, from the camera trajectories; (2)
// point-to-plane ICP; (3) ICP with scale; then the distances. A step that finds too few pairs
// leaves the similarity of the step before it. Throws like RegisterCloud and ComputeCloudError.
CloudEvaluation EvaluateCloud(const PointCloud& estimate, const PointCloud& truth,
                              const Similarity& S_truth_estimate,
                              std::span<const double> thresholds_m,
                              const CloudRegistrationOptions& options = {});

}  // namespace mono3d
