// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mono3d::tracking {
namespace {

constexpr std::size_t kNumCameras = 24;

// Cameras around a circle, looking in; the true relative similarities all have scale 1.
std::vector<Similarity> Circle() {
  std::vector<Similarity> cameras;
  for (std::size_t i = 0; i < kNumCameras; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kNumCameras;
    cameras.emplace_back(1, Pose(RotationExp({0, angle, 0}), Eigen::Vector3d(0, 0, 5)));
  }
  return cameras;
}

// Neighbours know each other but for an error that is the same in each step.
std::vector<SimilarityEdge> DriftingEdges(const Similarity& error) {
  const std::vector<Similarity> truth = Circle();
  std::vector<SimilarityEdge> edges;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    edges.push_back({i - 1, i, error * (truth[i] * truth[i - 1].Inverse())});
  }
  return edges;
}

std::vector<Similarity> Chain(const std::vector<SimilarityEdge>& edges) {
  std::vector<Similarity> cameras = {Circle()[0]};
  for (const SimilarityEdge& edge : edges) cameras.push_back(edge.S_b_a * cameras.back());
  return cameras;
}

Eigen::Vector3d Centre(const Similarity& S) { return S.Inverse() * Eigen::Vector3d::Zero(); }

TEST(OptimisePoseGraph, LeavesCamerasThatAgreeAlone) {
  const std::vector<SimilarityEdge> edges = DriftingEdges(Similarity());
  std::vector<Similarity> cameras = Chain(edges);
  OptimisePoseGraph(cameras, edges, 5);
  const std::vector<Similarity> truth = Circle();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_LT((Centre(cameras[i]) - Centre(truth[i])).norm(), 1e-6);
    EXPECT_NEAR(cameras[i].scale(), 1, 1e-6);
  }
}

TEST(OptimisePoseGraph, SpreadsTheDriftOfALoopOverAllCameras) {
  const Similarity error(1.01, Pose(RotationExp({0.001, 0.004, 0}), {0.01, 0, 0.01}));
  std::vector<SimilarityEdge> edges = DriftingEdges(error);
  std::vector<Similarity> cameras = Chain(edges);
  const std::vector<Similarity> truth = Circle();
  const double gap = (Centre(cameras.back()) - Centre(truth.back())).norm();
  ASSERT_GT(gap, 0.5);
  edges.push_back({0, kNumCameras - 1, truth.back() * truth.front().Inverse()});
  OptimisePoseGraph(cameras, edges, 5);
  EXPECT_EQ(cameras[0].pose().Matrix(), truth[0].pose().Matrix());
  EXPECT_EQ(cameras[0].scale(), 1);
  // One edge of 24 is true, and takes its part of the error like the others.
  constexpr double kShare = 0.15;
  EXPECT_LT((Centre(cameras.back()) - Centre(truth.back())).norm(), kShare * gap);
  EXPECT_NEAR(cameras.back().scale(), 1, kShare * std::pow(1.01, kNumCameras - 1) - kShare);
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const Similarity step = cameras[i] * cameras[i - 1].Inverse();
    EXPECT_NEAR(step.scale(), 1, 0.01);  // no step takes more than its own
  }
}

TEST(OptimisePoseGraph, LeavesLessOfTheGapToAnEdgeOfMoreWeight) {
  const Similarity error(1.01, Pose(RotationExp({0.001, 0.004, 0}), {0.01, 0, 0.01}));
  std::vector<SimilarityEdge> edges = DriftingEdges(error);
  const std::vector<Similarity> truth = Circle();
  edges.push_back({0, kNumCameras - 1, truth.back() * truth.front().Inverse()});
  const auto gap_with = [&](double weight) {
    edges.back().weight = weight;
    std::vector<Similarity> cameras = Chain({edges.begin(), edges.end() - 1});
    OptimisePoseGraph(cameras, edges, 5);
    return (Centre(cameras.back()) - Centre(truth.back())).norm();
  };
  // The loop takes 1 / weight beside the steps of the chain.
  EXPECT_NEAR(gap_with(8) / gap_with(1), 1.0 / 8, 0.03);
}

TEST(OptimisePoseGraph, DoesNotDependOnTheScaleOfTheWorld) {
  const Similarity error(1.01, Pose(RotationExp({0, 0.004, 0}), {0.01, 0, 0.01}));
  std::vector<SimilarityEdge> edges = DriftingEdges(error);
  std::vector<Similarity> cameras = Chain(edges);
  edges.push_back({0, kNumCameras - 1, Circle().back() * Circle().front().Inverse()});
  constexpr double kFactor = 50;
  const auto enlarged = [&](const Similarity& S) {
    return Similarity(S.scale(), Pose(S.pose().rotation(), kFactor * S.pose().translation()));
  };
  std::vector<Similarity> large;
  for (const Similarity& S : cameras) large.push_back(enlarged(S));
  std::vector<SimilarityEdge> large_edges = edges;
  for (SimilarityEdge& edge : large_edges) edge.S_b_a = enlarged(edge.S_b_a);
  OptimisePoseGraph(cameras, edges, 5);
  OptimisePoseGraph(large, large_edges, kFactor * 5);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_LT((kFactor * Centre(cameras[i]) - Centre(large[i])).norm(), 0.01 * kFactor) << i;
    EXPECT_NEAR(cameras[i].scale(), large[i].scale(), 1e-3);
  }
}

TEST(OptimisePoseGraph, DoesNothingToOneCameraOrWithoutEdges) {
  std::vector<Similarity> one = {Similarity(2, Pose())};
  OptimisePoseGraph(one, {}, 1);
  EXPECT_EQ(one[0].scale(), 2);
  std::vector<Similarity> two = {Similarity(2, Pose()), Similarity(3, Pose())};
  OptimisePoseGraph(two, {}, 1);
  EXPECT_EQ(two[1].scale(), 3);
}

}  // namespace
}  // namespace mono3d::tracking
