// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_evaluation.h"

#include "evaluation/cloud_distances.h"
#include "evaluation/cloud_icp.h"
#include "evaluation/cloud_surface.h"
#include "mono3d/evaluation/cloud_transform.h"

namespace mono3d {

CloudEvaluation EvaluateCloud(const PointCloud& estimate, const PointCloud& truth,
                              const Similarity& S_truth_estimate,
                              std::span<const double> thresholds_m,
                              const CloudRegistrationOptions& options) {
  options.Validate();
  CheckCloud(estimate, "estimate");
  CheckCloud(truth, "truth");
  const CloudSurface estimate_surface(estimate, options.num_normal_neighbours);
  const CloudSurface truth_surface(truth, options.num_normal_neighbours);

  CloudEvaluation evaluation;
  evaluation.error_at_start =
      ComputeCloudError(estimate_surface, S_truth_estimate, truth_surface, thresholds_m);
  const IcpPoints chosen = ChooseIcpPoints(estimate, options.max_points);
  evaluation.rigid = RegisterPoints(chosen, truth_surface, S_truth_estimate, false, options);
  evaluation.with_scale =
      RegisterPoints(chosen, truth_surface, evaluation.rigid.S_truth_estimate, true, options);
  evaluation.S_truth_estimate = evaluation.with_scale.S_truth_estimate;
  evaluation.error =
      ComputeCloudError(estimate_surface, evaluation.S_truth_estimate, truth_surface, thresholds_m);
  evaluation.estimate_in_truth = TransformCloud(evaluation.S_truth_estimate, estimate);
  return evaluation;
}

}  // namespace mono3d
