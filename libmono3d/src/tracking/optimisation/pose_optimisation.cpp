// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_optimisation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_constraint.h"

namespace mono3d::tracking {
namespace {

using Noises = std::vector<MeasurementNoise>;

Noises NoisesAt(const CameraModel& camera, const Pose& T,
                const std::vector<PointMeasurement>& measurements) {
  Noises noises;
  noises.reserve(measurements.size());
  for (const PointMeasurement& m : measurements) {
    noises.push_back(NoiseOf(camera, T.rotation(), T * m.p_world, m));
  }
  return noises;
}

// Squared error over its variance; infinite behind the camera.
double PoseChi2(const CameraModel& camera, const Pose& T, const PointMeasurement& m,
                const MeasurementNoise& noise) {
  const Eigen::Vector3d p_cam = T * m.p_world;
  if (p_cam.z() <= 0) return HUGE_VAL;
  return noise.Chi2(m.pixel - camera.Project(p_cam));
}

double PoseRobustCost(double chi2, bool robust) {
  if (!robust || chi2 <= kChi2TwoDof) return chi2;
  return 2 * std::sqrt(kChi2TwoDof * chi2) - kChi2TwoDof;  // Huber
}

struct Step {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

struct Solver {
  const CameraModel& camera;
  const std::vector<PointMeasurement>& measurements;
  const Noises& noises;
  const std::vector<char>& is_inlier;
  bool robust;

  double Cost(const Pose& T) const {
    double cost = 0;
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      if (is_inlier[i] != 0)
        cost += PoseRobustCost(PoseChi2(camera, T, measurements[i], noises[i]), robust);
    }
    return cost;
  }

  Step Linearise(const Pose& T) const {
    Step step;
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      if (is_inlier[i] == 0) continue;
      const PointMeasurement& m = measurements[i];
      const Eigen::Vector3d rotated = T.rotation() * m.p_world;
      const Eigen::Vector3d p_cam = rotated + T.translation();
      if (p_cam.z() <= 0) continue;
      const Eigen::Vector2d error = m.pixel - camera.Project(p_cam);
      double weight = noises[i].inverse_variance;
      const double chi2 = noises[i].Chi2(error);
      if (robust && chi2 > kChi2TwoDof) weight *= std::sqrt(kChi2TwoDof / chi2);
      const Eigen::Matrix<double, 2, 6> J = ProjectionJacobian(camera, p_cam, rotated);
      AddMeasurement(J, error, noises[i], weight, step.hessian, step.gradient);
    }
    return step;
  }

  Pose Minimise(Pose T) const {
    constexpr int kMaxSteps = 10;
    constexpr double kConverged = 1e-6;  // share of the cost
    double cost = Cost(T);
    double damping = 1e-6;
    for (int i = 0; i < kMaxSteps; ++i) {
      Step step = Linearise(T);
      step.hessian.diagonal() *= 1 + damping;
      const Vector6d delta = step.hessian.ldlt().solve(step.gradient);
      if (!delta.allFinite()) return T;
      const Pose moved(RotationExp(delta.head<3>()) * T.rotation(),
                       T.translation() + delta.tail<3>());
      const double new_cost = Cost(moved);
      if (!(new_cost < cost)) {
        damping = damping * 100 + 1e-4;
        continue;
      }
      T = moved;
      const bool converged = cost - new_cost < kConverged * cost;
      cost = new_cost;
      damping *= 0.1;
      if (converged) break;
    }
    return T;
  }
};

}  // namespace

MeasurementNoise NoiseOf(const CameraModel& camera, const Eigen::Quaterniond& R_cam_world,
                         const Eigen::Vector3d& p_cam, const PointMeasurement& measurement) {
  MeasurementNoise noise;
  const double variance = measurement.sigma_px * measurement.sigma_px;
  noise.inverse_variance = 1 / variance;
  if (measurement.depth_axis.isZero(0) || p_cam.z() <= 0) return noise;
  const Eigen::Vector3d axis = R_cam_world * measurement.depth_axis;
  // What the axis changes of the direction; along the line of sight it changes nothing.
  noise.v_px.x() = camera.fx * (axis.x() - p_cam.x() / p_cam.z() * axis.z()) / p_cam.z();
  noise.v_px.y() = camera.fy * (axis.y() - p_cam.y() / p_cam.z() * axis.z()) / p_cam.z();
  noise.share = 1 / (variance + noise.v_px.squaredNorm());
  return noise;
}

double NoiseScaleOf(std::vector<double> chi2) {
  constexpr double kQuarter = 0.5754;  // of the chi-squared distribution of two dimensions, 25 %
  if (chi2.empty()) return 1;
  const auto quarter = chi2.begin() + static_cast<std::ptrdiff_t>(chi2.size() / 4);
  std::ranges::nth_element(chi2, quarter);
  return std::sqrt(*quarter / kQuarter);
}

Eigen::Matrix<double, 2, 6> ProjectionJacobian(const CameraModel& camera,
                                               const Eigen::Vector3d& p_cam,
                                               const Eigen::Vector3d& rotated) {
  const double inverse_z = 1 / p_cam.z();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << camera.fx * inverse_z, 0, -camera.fx * p_cam.x() * inverse_z * inverse_z,  //
      0, camera.fy * inverse_z, -camera.fy * p_cam.y() * inverse_z * inverse_z;
  Eigen::Matrix3d cross;  // d (Exp(omega) r) / d omega = -[r]x
  cross << 0, rotated.z(), -rotated.y(), -rotated.z(), 0, rotated.x(), rotated.y(), -rotated.x(), 0;
  Eigen::Matrix<double, 2, 6> J;
  J.leftCols<3>().noalias() = by_point * cross;
  J.rightCols<3>() = by_point;
  return J;
}

PoseEstimate OptimisePose(const CameraModel& camera, const Pose& T_cam_world,
                          const std::vector<PointMeasurement>& measurements) {
  // As ORB-SLAM does it (Mur-Artal, Montiel, Tardos 2015): outliers are told apart after each.
  constexpr int kRounds = 4;
  constexpr int kRobustRounds = 2;
  PoseEstimate estimate{T_cam_world, std::vector<char>(measurements.size(), 1), 0, 0};
  for (int round = 0; round < kRounds; ++round) {
    const Noises noises = NoisesAt(camera, estimate.T_cam_world, measurements);
    const Solver solver{camera, measurements, noises, estimate.is_inlier, round < kRobustRounds};
    estimate.T_cam_world = solver.Minimise(estimate.T_cam_world);
    estimate.num_inliers = 0;
    double sum_px2 = 0;
    std::vector<double> all_chi2;
    all_chi2.reserve(measurements.size());
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      const double chi2 = PoseChi2(camera, estimate.T_cam_world, measurements[i], noises[i]);
      all_chi2.push_back(chi2);
      const bool fits = chi2 <= kChi2TwoDof;
      estimate.is_inlier[i] = fits ? 1 : 0;
      estimate.num_inliers += fits ? 1 : 0;
      if (fits) sum_px2 += chi2 * measurements[i].sigma_px * measurements[i].sigma_px;
    }
    if (estimate.num_inliers > 0) {
      estimate.reprojection_px = std::sqrt(sum_px2 / estimate.num_inliers);
    }
    estimate.noise_scale = NoiseScaleOf(std::move(all_chi2));
    if (estimate.num_inliers < kMinPoseInliers) break;
  }
  return estimate;
}

}  // namespace mono3d::tracking
