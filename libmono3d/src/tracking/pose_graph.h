// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <vector>

#include "mono3d/geometry/similarity.h"

namespace mono3d::tracking {

// What is known of two cameras: S_b_a maps points of camera a into camera b.
struct SimilarityEdge {
  std::size_t a = 0;
  std::size_t b = 0;
  Similarity S_b_a;
};

// Cameras as similarities S_cam_world, moved so that the edges agree (pose graph over Sim(3):
// Strasdat, Montiel, Davison 2010). Lengths are compared over `length`, a typical depth, so that
// rotation (rad), translation and log scale weigh alike. The first camera stays.
void OptimisePoseGraph(std::vector<Similarity>& S_cam_world,
                       const std::vector<SimilarityEdge>& edges, double length);

}  // namespace mono3d::tracking
