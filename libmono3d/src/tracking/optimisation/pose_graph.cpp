// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_graph.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/similarity_block.h"

namespace mono3d::tracking {
namespace {

// How far the actual T_b_a, in lengths of a, and scale are from the measured ones, in sigmas.
struct GraphConstraintError {
  SimilarityBlock measured;  // with the logarithm of the constraint's scale
  Matrix7d root_information;

  template <typename T>
  bool operator()(const T* const a, const T* const b, T* error) const {
    const std::array<T, 4> inverse_a = {a[0], -a[1], -a[2], -a[3]};
    const std::array<T, 4> inverse_measured = {T(measured[0]), T(-measured[1]), T(-measured[2]),
                                               T(-measured[3])};
    std::array<T, 4> actual_q;
    ceres::QuaternionProduct(b, inverse_a.data(), actual_q.data());
    std::array<T, 4> difference;
    ceres::QuaternionProduct(actual_q.data(), inverse_measured.data(), difference.data());
    Eigen::Matrix<T, 7, 1> deviation;
    ceres::QuaternionToAngleAxis(difference.data(), deviation.data());
    std::array<T, 3> of_anchor;
    ceres::QuaternionRotatePoint(actual_q.data(), a + 4, of_anchor.data());
    const std::array<T, 3> measured_t = {T(measured[4]), T(measured[5]), T(measured[6])};
    std::array<T, 3> expected;
    ceres::QuaternionRotatePoint(difference.data(), measured_t.data(), expected.data());
    using std::exp;
    const T to_anchor = exp(a[7] - b[7]);
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      deviation[3 + i] = to_anchor * b[4 + i] - of_anchor[at] - expected[at];
    }
    deviation[6] = a[7] - b[7] - measured[7];
    Eigen::Map<Eigen::Matrix<T, 7, 1>> whitened(error);
    whitened = root_information.cast<T>() * deviation;
    return true;
  }
};

}  // namespace

PoseGraphReport OptimisePoseGraph(std::vector<Similarity>& S_cam_world,
                                  const std::vector<SimilarityEdge>& edges, double length,
                                  const GraphConstraints& constraints) {
  if (S_cam_world.size() < 2 || edges.empty()) return {};
  std::vector<SimilarityBlock> blocks;
  for (const Similarity& S : S_cam_world) blocks.push_back(ToBlock(S));
  ceres::CauchyLoss loss(std::sqrt(kChi2SevenDof));
  SimilarityManifold manifold{ceres::QuaternionManifold{}, ceres::EuclideanManifold<4>{}};
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  for (SimilarityBlock& block : blocks) problem.AddParameterBlock(block.data(), 8, &manifold);
  problem.SetParameterBlockConstant(blocks.front().data());
  const bool is_constrained = !constraints.edges.empty();
  const double weight = is_constrained ? 1 / constraints.edge_sigma : 1;
  for (const SimilarityEdge& edge : edges) {
    const double of_edge = std::sqrt(edge.weight) * weight;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeError, 7, 8, 8>(
            new EdgeError{ToBlock(edge.S_b_a), of_edge, of_edge / length, of_edge, is_constrained}),
        nullptr, blocks[edge.a].data(), blocks[edge.b].data());
  }
  for (const ConstraintEdge& edge : constraints.edges) {
    const SimilarityBlock measured = ToBlock(Similarity(edge.scale, edge.T_b_a));
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<GraphConstraintError, 7, 8, 8>(
                                 new GraphConstraintError{measured, edge.root_information}),
                             edge.is_certain ? nullptr : &loss, blocks[edge.a].data(),
                             blocks[edge.b].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 50;
  options.num_threads = 1;  // sums in one order: same input, same bytes out
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  const PoseGraphReport report = {2 * summary.initial_cost, 2 * summary.final_cost};
  if (!summary.IsSolutionUsable()) return {report.initial_cost, report.initial_cost};
  for (std::size_t i = 1; i < blocks.size(); ++i) S_cam_world[i] = FromBlock(blocks[i]);
  return report;
}

}  // namespace mono3d::tracking
