// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/sparse_schur_solver.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_constraint.h"
#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

// A pose as Ceres sees it: quaternion x y z w, then the translation.
using PoseBlock = std::array<double, 7>;

PoseBlock PoseToBlock(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  const Eigen::Vector3d& t = pose.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Pose PoseFromBlock(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(block)),
          Eigen::Vector3d(block[4], block[5], block[6])};
}

// R' = Exp(omega) R, t' = t + dt. The cost functions hand out their Jacobian by (omega, dt) in the
// first six columns, so the Jacobian of Plus is an identity and costs nothing to think about.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> step(delta);
    const Pose pose = PoseFromBlock(x);
    const Pose moved(RotationExp(step.head<3>()) * pose.rotation(),
                     pose.translation() + step.tail<3>());
    const PoseBlock block = PoseToBlock(moved);
    std::copy(block.begin(), block.end(), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Pose pose_y = PoseFromBlock(y);
    const Pose pose_x = PoseFromBlock(x);
    Eigen::Map<Eigen::Matrix<double, 6, 1>> difference(y_minus_x);
    difference.head<3>() = RotationLog(pose_y.rotation() * pose_x.rotation().conjugate());
    difference.tail<3>() = pose_y.translation() - pose_x.translation();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const CameraModel& camera, const BundleAdjustmentObservation& observation)
      : camera_(camera), observation_(observation) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> rotation(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> translation(parameters[0] + 4);
    const Eigen::Matrix3d R = rotation.toRotationMatrix();
    const Eigen::Vector3d rotated = R * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    const Eigen::Vector3d p_cam = rotated + translation;
    if (p_cam.z() <= 0) return false;  // the step is refused
    const double weight = 1 / observation_.sigma_px;
    Eigen::Map<Eigen::Vector2d> residual(residuals);
    residual = weight * (camera_.Project(p_cam) - observation_.pixel);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 2, 6> J = weight * ProjectionJacobian(camera_, p_cam, rotated);
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.leftCols<6>() = J;
      by_pose.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point.noalias() = J.rightCols<3>() * R;
    }
    return true;
  }

 private:
  const CameraModel& camera_;
  BundleAdjustmentObservation observation_;
};

class PoseConstraintCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit PoseConstraintCost(const PoseConstraint& constraint) : constraint_(constraint) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const ConstraintDerivatives at =
        Derive(constraint_, PoseFromBlock(parameters[0]), PoseFromBlock(parameters[1]));
    Eigen::Map<Vector6d>{residuals} = at.error;
    if (jacobians == nullptr) return true;
    for (std::size_t i = 0; i < 2; ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> by_pose(jacobians[i]);
      by_pose.leftCols<6>() = i == 0 ? at.by_view : at.by_anchor;
      by_pose.col(6).setZero();
    }
    return true;
  }

 private:
  const PoseConstraint& constraint_;
};

class DepthPriorCost final : public ceres::SizedCostFunction<1, 3> {
 public:
  explicit DepthPriorCost(const DepthPrior& prior) : prior_(prior) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d p_world = Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    residuals[0] = prior_.WhitenedError(p_world);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Vector3d>{jacobians[0]} = prior_.ErrorByPoint(p_world);
    return true;
  }

 private:
  const DepthPrior& prior_;
};

// Ends with the best that has been found.
class StopCallback final : public ceres::IterationCallback {
 public:
  explicit StopCallback(const BundleAdjustmentOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return options_.IsStopped() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const BundleAdjustmentOptions& options_;
};

ceres::Solver::Options SolverOptions(int num_steps, double min_gain) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.max_num_iterations = num_steps;
  options.num_threads = 1;  // sums in one order: same input, same bytes out
  options.logging_type = ceres::SILENT;
  options.function_tolerance = min_gain;
  return options;
}

}  // namespace

void MinimiseSparsely(BundleAdjustmentProblem& problem, const std::vector<char>& left_out,
                      bool robust, int num_steps, const BundleAdjustmentOptions& bundle_options) {
  std::vector<PoseBlock> poses;
  for (const Pose& pose : problem.T_cam_world) poses.push_back(PoseToBlock(pose));
  ceres::HuberLoss loss(std::sqrt(kChi2TwoDof));
  PoseManifold manifold;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(ownership);
  const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<char> is_used(problem.p_world.size(), 0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ceres_problem.AddParameterBlock(poses[i].data(), 7, &manifold);
    if (problem.is_fixed[i] != 0) ceres_problem.SetParameterBlockConstant(poses[i].data());
    ordering->AddElementToGroup(poses[i].data(), 1);
  }
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (left_out[i] != 0) continue;
    const BundleAdjustmentObservation& observation = problem.observations[i];
    double* point = problem.p_world[observation.point].data();
    ceres_problem.AddResidualBlock(new ReprojectionCost(problem.camera, observation),
                                   robust ? &loss : nullptr, poses[observation.view].data(), point);
    if (is_used[observation.point] == 0) ordering->AddElementToGroup(point, 0);
    is_used[observation.point] = 1;
  }
  if (ceres_problem.NumResidualBlocks() == 0) return;
  for (const DepthPrior& prior : problem.depth_priors) {
    if (is_used[prior.point] == 0) continue;
    ceres_problem.AddResidualBlock(new DepthPriorCost(prior), nullptr,
                                   problem.p_world[prior.point].data());
  }
  ceres::CauchyLoss loss_of_constraint(std::sqrt(kChi2SixDof));
  for (const PoseConstraint& constraint : problem.constraints) {
    ceres_problem.AddResidualBlock(new PoseConstraintCost(constraint), &loss_of_constraint,
                                   poses[constraint.view].data(), poses[constraint.anchor].data());
  }
  ceres::Solver::Options options = SolverOptions(num_steps, bundle_options.min_gain);
  options.linear_solver_ordering = ordering;
  StopCallback stop(bundle_options);
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  if (!summary.IsSolutionUsable()) return;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (problem.is_fixed[i] == 0) problem.T_cam_world[i] = PoseFromBlock(poses[i].data());
  }
}

}  // namespace mono3d::tracking
