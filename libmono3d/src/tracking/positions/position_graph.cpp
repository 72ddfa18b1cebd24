// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/position_graph.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/similarity_block.h"

namespace mono3d::tracking {
namespace {

using Wander = std::array<double, 3>;

// A position minus its wandering error and the point that it is of, over the white error.
struct PositionError {
  Eigen::Vector3d p_kf;
  Eigen::Vector3d velocity_kf;
  Eigen::Vector3d p_m;
  Eigen::Vector3d weight;  // 0: not measured

  template <typename T>
  bool operator()(const T* const keyframe, const T* const wander, const T* const clock,
                  T* error) const {
    using std::exp;
    const std::array<T, 4> inverse = {keyframe[0], -keyframe[1], -keyframe[2], -keyframe[3]};
    const std::array<T, 3> rotated = {p_kf.x() + velocity_kf.x() * clock[0] - keyframe[4],
                                      p_kf.y() + velocity_kf.y() * clock[0] - keyframe[5],
                                      p_kf.z() + velocity_kf.z() * clock[0] - keyframe[6]};
    std::array<T, 3> p;
    ceres::QuaternionRotatePoint(inverse.data(), rotated.data(), p.data());
    const T scale = exp(-keyframe[7]);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      error[i] = (p_m[axis] - scale * p[i] - wander[i]) * weight[axis];
    }
    return true;
  }
};

// A known point minus where the keyframe has it, over what both may err by.
struct KnownPointError {
  Eigen::Vector3d p_kf;
  Eigen::Vector3d p_m;
  Eigen::Matrix3d weight;

  template <typename T>
  bool operator()(const T* const keyframe, T* error) const {
    const std::array<T, 3> still = {T(0), T(0), T(0)};
    std::array<T, 3> off;
    const PositionError metres{p_kf, Eigen::Vector3d::Zero(), p_m, Eigen::Vector3d::Ones()};
    metres(keyframe, still.data(), still.data(), off.data());
    for (int i = 0; i < 3; ++i) {
      error[i] = weight(i, 0) * off[0] + weight(i, 1) * off[1] + weight(i, 2) * off[2];
    }
    return true;
  }
};

// What a wandering error changes by within a time, over what it may.
struct WanderError {
  Eigen::Vector3d kept;
  Eigen::Vector3d weight;

  template <typename T>
  bool operator()(const T* const before, const T* const after, T* error) const {
    for (int i = 0; i < 3; ++i) error[i] = (after[i] - kept[i] * before[i]) * weight[i];
    return true;
  }
};

struct FirstWanderError {
  Eigen::Vector3d weight;

  template <typename T>
  bool operator()(const T* const first, T* error) const {
    for (int i = 0; i < 3; ++i) error[i] = first[i] * weight[i];
    return true;
  }
};

// How far the clock is off, over what it may be.
struct ClockError {
  double expected_s;
  double weight;

  template <typename T>
  bool operator()(const T* const clock, T* error) const {
    error[0] = (clock[0] - expected_s) * weight;
    return true;
  }
};

// How far a keyframe has turned.
struct TurnError {
  std::array<double, 4> before;
  double weight;

  template <typename T>
  bool operator()(const T* const keyframe, T* error) const {
    const std::array<T, 4> inverse = {T(before[0]), T(-before[1]), T(-before[2]), T(-before[3])};
    std::array<T, 4> turn;
    ceres::QuaternionProduct(keyframe, inverse.data(), turn.data());
    ceres::QuaternionToAngleAxis(turn.data(), error);
    for (int i = 0; i < 3; ++i) error[i] *= weight;
    return true;
  }
};

class PositionGraph {
 public:
  PositionGraph(const PathNoise& noise, const std::vector<char>& is_outlier, PositionedPath& path)
      : noise_(noise), path_(path), problem_(Ownership()) {
    Centre();
    AddKeyframes();
    AddEdges();
    AddPositions(is_outlier);
  }

  bool Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 50;
    options.num_threads = 1;  // sums in one order: same input, same bytes out
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) return false;
    const Similarity S_metric_middle(1, Pose(Eigen::Quaterniond::Identity(), middle_m_));
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      path_.S_metric_kf[i] = S_metric_middle * FromBlock(keyframes_[i]).Inverse();
    }
    return true;
  }

 private:
  static ceres::Problem::Options Ownership() {
    ceres::Problem::Options ownership;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return ownership;
  }

  void Centre() {
    for (const Similarity& S : path_.S_metric_kf) middle_m_ += S.pose().translation();
    middle_m_ /= static_cast<double>(path_.S_metric_kf.size());
  }

  void AddKeyframes() {
    const Similarity S_middle_metric(1, Pose(Eigen::Quaterniond::Identity(), -middle_m_));
    for (const Similarity& S_metric_kf : path_.S_metric_kf) {
      keyframes_.push_back(ToBlock((S_middle_metric * S_metric_kf).Inverse()));
    }
    for (SimilarityBlock& block : keyframes_) {
      problem_.AddParameterBlock(block.data(), 8, &manifold_);
    }
    // Beyond this a similarity to the positions is not taken for found.
    constexpr double kLargestTurn_rad = 0.35;
    SimilarityBlock& middle = keyframes_[keyframes_.size() / 2];
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<TurnError, 3, 8>(
            new TurnError{{middle[0], middle[1], middle[2], middle[3]}, 1 / kLargestTurn_rad}),
        nullptr, middle.data());
  }

  void AddEdges() {
    const double rotation = 1 / noise_.drift.rotation_rad;
    const double scale = 1 / noise_.drift.log_scale;
    const double shift = 1 / path_.shift;
    for (const SimilarityEdge& edge : path_.edges) {
      const double weight = std::sqrt(edge.weight);
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<EdgeError, 7, 8, 8>(new EdgeError{
              ToBlock(edge.S_b_a), weight * rotation, weight * shift, weight * scale, true}),
          nullptr, keyframes_[edge.a].data(), keyframes_[edge.b].data());
    }
  }

  const PositionNoise& NoiseOf(int axis) const {
    return axis < 2 ? noise_.horizontal : noise_.vertical;
  }

  void AddPositions(const std::vector<char>& is_outlier) {
    Eigen::Vector3d weight = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < (path_.has_vertical ? 3 : 2); ++axis) {
      weight[axis] = 1 / NoiseOf(axis).white_m;
    }
    AddClock();
    wander_.assign(path_.positions.size(), Wander{});
    std::size_t last = path_.positions.size();
    for (std::size_t i = 0; i < path_.positions.size(); ++i) {
      if (is_outlier[i] != 0) continue;
      const PathPosition& position = path_.positions[i];
      if (position.covariance_m2) {
        AddKnownPoint(position);
        continue;
      }
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PositionError, 3, 8, 3, 1>(new PositionError{
              position.p_kf, position.velocity_kf, position.p_m - middle_m_, weight}),
          &loss_, keyframes_[position.node].data(), wander_[i].data(), &clock_offset_s_);
      AddWander(last < path_.positions.size() ? &path_.positions[last] : nullptr, i, last);
      last = i;
    }
  }

  void AddClock() {
    clock_offset_s_ = path_.clock_offset_s;
    problem_.AddParameterBlock(&clock_offset_s_, 1);
    if (path_.clock_offset_sigma_s > 0) {
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<ClockError, 1, 1>(new ClockError{
                                    path_.clock_offset_s, 1 / path_.clock_offset_sigma_s}),
                                nullptr, &clock_offset_s_);
    } else {
      problem_.SetParameterBlockConstant(&clock_offset_s_);
    }
  }

  void AddKnownPoint(const PathPosition& position) {
    const Eigen::Matrix3d root = position.covariance_m2->llt().matrixL();
    const Eigen::Matrix3d weight =
        root.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<KnownPointError, 3, 8>(
            new KnownPointError{position.p_kf, position.p_m - middle_m_, weight}),
        &of_known_points_, keyframes_[position.node].data());
  }

  void AddWander(const PathPosition* before, std::size_t i, std::size_t last) {
    Eigen::Vector3d kept = Eigen::Vector3d::Zero();
    Eigen::Vector3d weight;
    for (int axis = 0; axis < 3; ++axis) {
      const PositionNoise& noise = NoiseOf(axis);
      if (before != nullptr && noise.correlation_s > 0) {
        kept[axis] = std::exp((before->time_s - path_.positions[i].time_s) / noise.correlation_s);
      }
      // Where it is not measured, or two are of one time, it has to be held all the same.
      constexpr double kLeast_m = 1e-6;
      weight[axis] =
          1 / std::max(kLeast_m, noise.wander_m * std::sqrt(1 - kept[axis] * kept[axis]));
    }
    if (before == nullptr) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<FirstWanderError, 3, 3>(new FirstWanderError{weight}),
          nullptr, wander_[i].data());
      return;
    }
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<WanderError, 3, 3, 3>(new WanderError{kept, weight}),
        nullptr, wander_[last].data(), wander_[i].data());
  }

  const PathNoise& noise_;
  PositionedPath& path_;
  Eigen::Vector3d middle_m_ = Eigen::Vector3d::Zero();
  std::vector<SimilarityBlock> keyframes_;  // S_kf_metric, about the middle
  std::vector<Wander> wander_;              // of each position
  double clock_offset_s_ = 0;
  SimilarityManifold manifold_{ceres::QuaternionManifold{}, ceres::EuclideanManifold<4>{}};
  ceres::CauchyLoss loss_{std::sqrt(kChi2ThreeDof)};
  // Wrong ones are outliers by then. To the others a path that is bent has to come from afar.
  ceres::HuberLoss of_known_points_{std::sqrt(kChi2ThreeDof)};
  ceres::Problem problem_;  // ends first
};

}  // namespace

bool OptimisePath(const PathNoise& noise, const std::vector<char>& is_outlier,
                  PositionedPath& path) {
  return PositionGraph(noise, is_outlier, path).Solve();
}

}  // namespace mono3d::tracking
