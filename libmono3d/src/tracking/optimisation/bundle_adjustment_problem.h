// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "tracking/optimisation/pose_constraint.h"

namespace mono3d::tracking {

struct BundleAdjustmentObservation {
  std::size_t view = 0;
  std::size_t point = 0;
  Eigen::Vector2d pixel;
  double sigma_px = 1;
};

// What is guessed of a point's inverse distance from a place.
struct DepthPrior {
  std::size_t point = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double inverse_distance = 0;
  double sigma = 0;  // of the inverse distance

  // Over sigma; the inverse distance changes by -direction / distance^2 with the point.
  double WhitenedError(const Eigen::Vector3d& p_world) const {
    return (inverse_distance - 1 / (p_world - centre).norm()) / sigma;
  }
  Eigen::Vector3d ErrorByPoint(const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d line = p_world - centre;
    const double distance = line.norm();
    return line / (distance * distance * distance * sigma);
  }
};

struct BundleAdjustmentProblem {
  CameraModel camera;
  std::vector<Pose> T_cam_world;  // of each view
  std::vector<char> is_fixed;     // of each view
  std::vector<Eigen::Vector3d> p_world;
  std::vector<BundleAdjustmentObservation> observations;
  std::vector<PoseConstraint> constraints;  // besides, with Cauchy's loss
  std::vector<DepthPrior> depth_priors;     // besides, at most one of each point
};

struct BundleAdjustmentOptions {
  int num_robust_steps = 5;
  int num_steps = 10;  // after the outliers are gone
  // A step that lowers the cost by less than this share of it is the last one. Long loops converge
  // in many small steps.
  double min_gain = 1e-4;
  // When it becomes true, the step under way is the last one; what it has found by then counts.
  const std::atomic<bool>* stop = nullptr;

  bool IsStopped() const { return stop != nullptr && stop->load(); }
};

}  // namespace mono3d::tracking
