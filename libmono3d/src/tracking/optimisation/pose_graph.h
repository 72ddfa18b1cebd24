// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "tracking/optimisation/pose_constraint.h"

namespace mono3d::tracking {

// What is known of two cameras: S_b_a maps points of camera a into camera b.
struct SimilarityEdge {
  std::size_t a = 0;
  std::size_t b = 0;
  Similarity S_b_a;
  double weight = 1;  // of its squared error
};

// What is known of two cameras with its uncertainty, as in KeyframeConstraint: a is the anchor.
struct ConstraintEdge {
  std::size_t a = 0;
  std::size_t b = 0;
  Pose T_b_a;        // in lengths of a
  double scale = 1;  // by which lengths of b become such of a
  Matrix7d root_information;
  // Else with Cauchy's loss beyond chi2 at 95 %.
  bool is_certain = false;
};

struct GraphConstraints {
  std::vector<ConstraintEdge> edges;
  double edge_sigma = 1;  // of each of the seven errors of any other edge
};

// Twice the cost, with constraints: a sum of squares in sigmas.
struct PoseGraphReport {
  double initial_cost = 0;
  double final_cost = 0;
};

// Cameras as similarities S_cam_world, moved so that the edges agree (pose graph over Sim(3):
// Strasdat, Montiel, Davison 2010). Lengths are compared over `length`, a typical depth, so that
// rotation (rad), translation and log scale weigh alike. The first camera stays.
PoseGraphReport OptimisePoseGraph(std::vector<Similarity>& S_cam_world,
                                  const std::vector<SimilarityEdge>& edges, double length,
                                  const GraphConstraints& constraints = {});

}  // namespace mono3d::tracking
