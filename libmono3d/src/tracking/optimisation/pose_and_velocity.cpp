// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_and_velocity.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

struct RollingState {
  Pose T_cam_world;
  CameraVelocity velocity;
};

RollingState MovedBy(const RollingState& state, const Vector12d& delta) {
  RollingState moved = state;
  moved.T_cam_world = Pose(RotationExp(delta.head<3>()) * state.T_cam_world.rotation(),
                           state.T_cam_world.translation() + delta.segment<3>(3));
  moved.velocity.angular_rad_per_s += delta.segment<3>(6);
  moved.velocity.linear_su_per_s += delta.tail<3>();
  return moved;
}

class RollingSolver {
 public:
  RollingSolver(const CameraModel& camera, const CameraModel& sensor, const VelocityPrior& prior,
                const std::vector<PointMeasurement>& measurements)
      : camera_(camera), sensor_(sensor), prior_(prior), measurements_(measurements) {
    // A measured pixel tells its line, which does not depend on the unknowns.
    const ShutterMotion lines(sensor, prior.mean);
    for (const PointMeasurement& m : measurements) {
      times_s_.push_back(lines.Time_s(camera.Unproject(m.pixel)));
    }
  }

  // What the depths of points leave open, by the state as it is (see MeasurementNoise).
  void TakeNoise(const RollingState& state) {
    noises_.clear();
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      noises_.push_back(
          NoiseOf(camera_, state.T_cam_world.rotation(), AtLine(state, i), measurements_[i]));
    }
  }

  // Squared error over its variance; infinite behind the camera.
  double Chi2(const RollingState& state, std::size_t i) const {
    const PointMeasurement& m = measurements_[i];
    const Eigen::Vector3d p_line = AtLine(state, i);
    if (p_line.z() <= 0) return HUGE_VAL;
    return noises_[i].Chi2(m.pixel - camera_.Project(p_line));
  }

  RollingState Minimise(RollingState state, const std::vector<char>& is_inlier, bool robust) const {
    constexpr int kMaxSteps = 10;
    constexpr double kConverged = 1e-6;  // share of the cost
    double cost = Cost(state, is_inlier, robust);
    double damping = 1e-6;
    for (int i = 0; i < kMaxSteps; ++i) {
      Matrix12d hessian = Matrix12d::Zero();
      Vector12d gradient = Vector12d::Zero();
      Linearise(state, is_inlier, robust, hessian, gradient);
      hessian.diagonal() *= 1 + damping;
      const Vector12d delta = hessian.ldlt().solve(gradient);
      if (!delta.allFinite()) return state;
      const RollingState moved = MovedBy(state, delta);
      const double new_cost = Cost(moved, is_inlier, robust);
      if (!(new_cost < cost)) {
        damping = damping * 100 + 1e-4;
        continue;
      }
      state = moved;
      const bool converged = cost - new_cost < kConverged * cost;
      cost = new_cost;
      damping *= 0.1;
      if (converged) break;
    }
    return state;
  }

 private:
  Eigen::Vector3d AtLine(const RollingState& state, std::size_t i) const {
    return state.velocity.T_later_now(times_s_[i]) * (state.T_cam_world * measurements_[i].p_world);
  }

  // Standard deviations of the velocity, held ones so small that they do not move.
  Eigen::Matrix<double, 6, 1> PriorWeights() const {
    constexpr double kHeld = 1e12;
    const auto weight = [](double sigma) { return sigma > 0 ? 1 / (sigma * sigma) : kHeld; };
    Eigen::Matrix<double, 6, 1> weights;
    weights << Eigen::Vector3d::Constant(weight(prior_.angular_sigma_rad_per_s)),
        Eigen::Vector3d::Constant(weight(prior_.linear_sigma_su_per_s));
    return weights;
  }

  Eigen::Matrix<double, 6, 1> FromPrior(const RollingState& state) const {
    Eigen::Matrix<double, 6, 1> difference;
    difference << state.velocity.angular_rad_per_s - prior_.mean.angular_rad_per_s,
        state.velocity.linear_su_per_s - prior_.mean.linear_su_per_s;
    return difference;
  }

  double Cost(const RollingState& state, const std::vector<char>& is_inlier, bool robust) const {
    double cost = FromPrior(state).cwiseAbs2().dot(PriorWeights());
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      if (is_inlier[i] == 0) continue;
      const double chi2 = Chi2(state, i);
      cost +=
          !robust || chi2 <= kChi2TwoDof ? chi2 : 2 * std::sqrt(kChi2TwoDof * chi2) - kChi2TwoDof;
    }
    return cost;
  }

  void Linearise(const RollingState& state, const std::vector<char>& is_inlier, bool robust,
                 Matrix12d& hessian, Vector12d& gradient) const {
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      if (is_inlier[i] == 0) continue;
      const PointMeasurement& m = measurements_[i];
      const Eigen::Vector3d p_line = AtLine(state, i);
      if (p_line.z() <= 0) continue;
      const Eigen::Vector2d error = m.pixel - camera_.Project(p_line);
      double weight = noises_[i].inverse_variance;
      const double chi2 = noises_[i].Chi2(error);
      if (robust && chi2 > kChi2TwoDof) weight *= std::sqrt(kChi2TwoDof / chi2);
      const Eigen::Vector3d rotated = state.T_cam_world.rotation() * m.p_world;
      const Eigen::Vector3d p_cam = rotated + state.T_cam_world.translation();
      // The turn between the middle line and this one is left out: below a degree.
      Eigen::Matrix<double, 2, 12> J;
      J.leftCols<6>() = ProjectionJacobian(camera_, p_line, rotated);
      J.rightCols<6>() = times_s_[i] * ProjectionJacobian(camera_, p_line, p_cam);
      AddMeasurement(J, error, noises_[i], weight, hessian, gradient);
    }
    hessian.diagonal().tail<6>() += PriorWeights();
    gradient.tail<6>() -= PriorWeights().cwiseProduct(FromPrior(state));
  }

  const CameraModel& camera_;
  const CameraModel& sensor_;
  const VelocityPrior& prior_;
  const std::vector<PointMeasurement>& measurements_;
  std::vector<double> times_s_;
  std::vector<MeasurementNoise> noises_;
};

}  // namespace

PoseAndVelocity OptimisePoseAndVelocity(const CameraModel& camera, const CameraModel& sensor,
                                        const Pose& T_cam_world, const VelocityPrior& prior,
                                        const std::vector<PointMeasurement>& measurements) {
  constexpr int kRounds = 4;
  constexpr int kRobustRounds = 2;
  RollingSolver solver(camera, sensor, prior, measurements);
  RollingState state{T_cam_world, prior.mean};
  PoseEstimate estimate{T_cam_world, std::vector<char>(measurements.size(), 1), 0, 0};
  for (int round = 0; round < kRounds; ++round) {
    solver.TakeNoise(state);
    state = solver.Minimise(state, estimate.is_inlier, round < kRobustRounds);
    estimate.num_inliers = 0;
    double sum_px2 = 0;
    std::vector<double> all_chi2;
    all_chi2.reserve(measurements.size());
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      const double chi2 = solver.Chi2(state, i);
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
  estimate.T_cam_world = state.T_cam_world;
  return {estimate, state.velocity};
}

}  // namespace mono3d::tracking
