// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/pose_graph.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>

namespace mono3d::tracking {
namespace {

// Quaternion w x y z as Ceres has it, translation, log of the scale.
using Block = std::array<double, 8>;

Block ToBlock(const Similarity& S) {
  const Eigen::Quaterniond& q = S.pose().rotation();
  const Eigen::Vector3d& t = S.pose().translation();
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), std::log(S.scale())};
}

Similarity FromBlock(const Block& block) {
  return {std::exp(block[7]), Pose(Eigen::Quaterniond(block[0], block[1], block[2], block[3]),
                                   Eigen::Vector3d(block[4], block[5], block[6]))};
}

// How far S_b is from S_b_a * S_a: rotation, translation over `length`, log scale.
struct EdgeError {
  Block measured;
  double length;

  template <typename T>
  bool operator()(const T* const a, const T* const b, T* error) const {
    const std::array<T, 4> measured_q = {T(measured[0]), T(measured[1]), T(measured[2]),
                                         T(measured[3])};
    std::array<T, 4> expected_q;
    ceres::QuaternionProduct(measured_q.data(), a, expected_q.data());
    const std::array<T, 4> inverse_b = {b[0], -b[1], -b[2], -b[3]};
    std::array<T, 4> difference;
    ceres::QuaternionProduct(expected_q.data(), inverse_b.data(), difference.data());
    ceres::QuaternionToAngleAxis(difference.data(), error);
    std::array<T, 3> moved;
    ceres::QuaternionRotatePoint(measured_q.data(), a + 4, moved.data());
    const double scale = std::exp(measured[7]);
    for (std::size_t i = 0; i < 3; ++i) {
      error[3 + i] = (scale * moved[i] + measured[4 + i] - b[4 + i]) / length;
    }
    error[6] = a[7] + measured[7] - b[7];
    return true;
  }
};

// Quaternion on its sphere, the rest as it is.
using Manifold = ceres::ProductManifold<ceres::QuaternionManifold, ceres::EuclideanManifold<4>>;

}  // namespace

void OptimisePoseGraph(std::vector<Similarity>& S_cam_world,
                       const std::vector<SimilarityEdge>& edges, double length) {
  if (S_cam_world.size() < 2 || edges.empty()) return;
  std::vector<Block> blocks;
  for (const Similarity& S : S_cam_world) blocks.push_back(ToBlock(S));
  Manifold manifold{ceres::QuaternionManifold{}, ceres::EuclideanManifold<4>{}};
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  for (Block& block : blocks) problem.AddParameterBlock(block.data(), 8, &manifold);
  problem.SetParameterBlockConstant(blocks.front().data());
  for (const SimilarityEdge& edge : edges) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeError, 7, 8, 8>(
                                 new EdgeError{ToBlock(edge.S_b_a), length}),
                             nullptr, blocks[edge.a].data(), blocks[edge.b].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 50;
  options.num_threads = 1;  // sums in one order: same input, same bytes out
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return;
  for (std::size_t i = 1; i < blocks.size(); ++i) S_cam_world[i] = FromBlock(blocks[i]);
}

}  // namespace mono3d::tracking
