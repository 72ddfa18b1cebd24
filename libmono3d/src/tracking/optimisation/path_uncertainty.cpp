// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/path_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using PoseByPoint = Eigen::Matrix<double, 6, 3>;

Eigen::Vector3d MeanOfPath(const std::vector<Pose>& T_cam_world,
                           const std::vector<std::size_t>& views) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::size_t view : views) sum += T_cam_world[view].Inverse().translation();
  return sum / static_cast<double>(views.size());
}

// By the steps (omega, dt) of all views, of the logarithm of the size of the path of some.
Eigen::VectorXd SizeGradient(const BundleAdjustmentProblem& problem,
                             const std::vector<std::size_t>& views) {
  const Eigen::Vector3d mean = MeanOfPath(problem.T_cam_world, views);
  Eigen::VectorXd gradient =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * problem.T_cam_world.size()));
  double squared_size = 0;
  for (const std::size_t view : views) {
    const Pose& T = problem.T_cam_world[view];
    const Eigen::Vector3d off = T.Inverse().translation() - mean;
    squared_size += off.squaredNorm();
    const Eigen::Vector3d off_cam = T.rotation() * off;
    Vector6d of_view;  // the centre -R' t moves by R' (omega x t - dt)
    of_view << T.translation().cross(off_cam), -off_cam;
    gradient.segment<6>(static_cast<Eigen::Index>(6 * view)) = of_view;
  }
  if (squared_size > 0) gradient /= squared_size;
  return gradient;
}

// By the steps (omega, dt) of all views, of the rotation of view `b` against view `a`:
// Exp(omega_b) R_b R_a' Exp(-omega_a).
Eigen::MatrixXd TurnGradients(const BundleAdjustmentProblem& problem, std::size_t a,
                              std::size_t b) {
  const Eigen::Quaterniond R_b_a =
      problem.T_cam_world[b].rotation() * problem.T_cam_world[a].rotation().conjugate();
  Eigen::MatrixXd gradients =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * problem.T_cam_world.size()), 3);
  gradients.middleRows<3>(static_cast<Eigen::Index>(6 * b)).setIdentity();
  gradients.middleRows<3>(static_cast<Eigen::Index>(6 * a)) -= R_b_a.toRotationMatrix().transpose();
  return gradients;
}

std::size_t Middle(const std::vector<std::size_t>& views) { return views[views.size() / 2]; }

// What the observations of one point say about the views that see it.
class PointInformation {
 public:
  void Add(std::size_t view, const Eigen::Matrix<double, 2, 6>& by_view,
           const Eigen::Matrix<double, 2, 3>& by_point) {
    views_.push_back(view);
    mixed_.push_back(by_view.transpose() * by_point);
    of_point_ += by_point.transpose() * by_point;
  }

  // Takes from the information of the views what the point's position uses up.
  void Eliminate(Eigen::MatrixXd& information) const {
    if (views_.empty()) return;
    Eigen::Matrix3d hessian = of_point_;
    // Without parallax it is free along its ray.
    hessian.diagonal().array() += 1e-12 * hessian.trace() + 1e-30;
    const Eigen::Matrix3d inverse = hessian.inverse();
    for (std::size_t a = 0; a < views_.size(); ++a) {
      const PoseByPoint weighted = mixed_[a] * inverse;
      for (std::size_t b = 0; b < views_.size(); ++b) {
        information.block<6, 6>(static_cast<Eigen::Index>(6 * views_[a]),
                                static_cast<Eigen::Index>(6 * views_[b])) -=
            weighted * mixed_[b].transpose();
      }
    }
  }

 private:
  std::vector<std::size_t> views_;
  std::vector<PoseByPoint> mixed_;
  Eigen::Matrix3d of_point_ = Eigen::Matrix3d::Zero();
};

struct PixelInformation {
  Eigen::MatrixXd of_views;
  double sum_chi2 = 0;
  std::size_t num_observations = 0;
};

PixelInformation InformationOf(const BundleAdjustmentProblem& problem) {
  PixelInformation result;
  const auto size = static_cast<Eigen::Index>(6 * problem.T_cam_world.size());
  result.of_views = Eigen::MatrixXd::Zero(size, size);
  std::vector<PointInformation> points(problem.p_world.size());
  for (const BundleAdjustmentObservation& seen : problem.observations) {
    const Pose& T = problem.T_cam_world[seen.view];
    const Eigen::Vector3d rotated = T.rotation() * problem.p_world[seen.point];
    const Eigen::Vector3d p_cam = rotated + T.translation();
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d error = (seen.pixel - problem.camera.Project(p_cam)) / seen.sigma_px;
    if (error.squaredNorm() > kChi2TwoDof) continue;
    const Eigen::Matrix<double, 2, 6> by_view =
        ProjectionJacobian(problem.camera, p_cam, rotated) / seen.sigma_px;
    const Eigen::Matrix<double, 2, 3> by_point =
        by_view.rightCols<3>() * T.rotation().toRotationMatrix();
    const auto at = static_cast<Eigen::Index>(6 * seen.view);
    result.of_views.block<6, 6>(at, at) += by_view.transpose() * by_view;
    points[seen.point].Add(seen.view, by_view, by_point);
    result.sum_chi2 += error.squaredNorm();
    ++result.num_observations;
  }
  for (const PointInformation& point : points) point.Eliminate(result.of_views);
  return result;
}

}  // namespace

double PathSize(const std::vector<Pose>& T_cam_world, const std::vector<std::size_t>& views) {
  const Eigen::Vector3d mean = MeanOfPath(T_cam_world, views);
  double squared_size = 0;
  for (const std::size_t view : views) {
    squared_size += (T_cam_world[view].Inverse().translation() - mean).squaredNorm();
  }
  return std::sqrt(squared_size);
}

PathSigma RelativePathSigma(const BundleAdjustmentProblem& problem,
                            const std::vector<std::size_t>& before,
                            const std::vector<std::size_t>& after) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr PathSigma kOpen = {kInfinity, kInfinity, 0};
  if (before.size() < 2 || after.size() < 2) return kOpen;
  PixelInformation information = InformationOf(problem);
  const double num_free = 2 * static_cast<double>(information.num_observations) -
                          3 * static_cast<double>(problem.p_world.size()) -
                          6 * static_cast<double>(problem.T_cam_world.size());
  if (num_free < 1) return kOpen;
  const Eigen::VectorXd by_before = SizeGradient(problem, before);
  // The four quantities: turns about three axes, log scale.
  Eigen::MatrixXd gradients(by_before.size(), 4);
  gradients.leftCols<3>() = TurnGradients(problem, Middle(before), Middle(after));
  gradients.col(3) = SizeGradient(problem, after);
  // None of them depends on where the first view is, nor on the unit: both are fixed.
  const double large = 1e6 * information.of_views.diagonal().maxCoeff();
  information.of_views.topLeftCorner<6, 6>().diagonal().array() += large;
  information.of_views += large * by_before * by_before.transpose() / by_before.squaredNorm();
  information.of_views.diagonal().array() += 1e-18 * large;
  const Eigen::LDLT<Eigen::MatrixXd> factors(information.of_views);
  const Eigen::Vector4d variances =
      gradients.cwiseProduct(factors.solve(gradients)).colwise().sum().transpose();
  if (factors.info() != Eigen::Success || !(variances.minCoeff() > 0)) return kOpen;
  // Residuals below what is assumed make nothing more certain: the error of a patch is much the
  // same from frame to frame, and its point takes it up.
  const double residual = std::sqrt(information.sum_chi2 / num_free);
  const double excess = std::max(1.0, residual);
  return {excess * std::sqrt(variances.head<3>().mean()), excess * std::sqrt(variances[3]),
          residual};
}

}  // namespace mono3d::tracking
