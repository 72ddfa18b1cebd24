// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/pose_and_velocity.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_constraint.h"

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

// Normal equations and the cost that they are of.
struct RollingEquations {
  double cost = 0;
  Matrix12d hessian;
  Vector12d gradient;
};

// Sums over the measurements of the parts of their normal equations. A measurement has the
// Jacobian J by the pose at its line, 2 x 6, and by the velocity t J K: t the time of its line, K
// the same for all.
class RollingSums {
 public:
  // `W`: information of the error; J by the axes of ProjectionJacobian.
  void Add(const Eigen::Matrix<double, 2, 6>& J, const Eigen::Matrix2d& W,
           const Eigen::Vector2d& error, double time_s) {
    const Eigen::Matrix<double, 2, 6> WJ = W.lazyProduct(J);
    const Matrix6d JWJ = J.transpose().lazyProduct(WJ);
    const Vector6d JWe = WJ.transpose().lazyProduct(error);
    hessian_ += JWJ;
    hessian_t_ += time_s * JWJ;
    hessian_tt_ += (time_s * time_s) * JWJ;
    gradient_ += JWe;
    gradient_t_ += time_s * JWe;
  }

  // The velocity turns points about the camera, the pose about the origin of the world's axes as
  // the camera sees them: `t_cam_world` is between.
  void Fill(const Eigen::Vector3d& t_cam_world, RollingEquations& equations) const {
    Matrix6d K = Matrix6d::Identity();
    const Eigen::Vector3d& t = t_cam_world;
    K.bottomLeftCorner<3, 3>() << 0, t.z(), -t.y(), -t.z(), 0, t.x(), t.y(), -t.x(), 0;
    equations.hessian.topLeftCorner<6, 6>() = hessian_;
    equations.hessian.topRightCorner<6, 6>() = hessian_t_ * K;
    equations.hessian.bottomLeftCorner<6, 6>() =
        equations.hessian.topRightCorner<6, 6>().transpose();
    equations.hessian.bottomRightCorner<6, 6>() = K.transpose() * hessian_tt_ * K;
    equations.gradient.head<6>() = gradient_;
    equations.gradient.tail<6>() = K.transpose() * gradient_t_;
  }

 private:
  Matrix6d hessian_ = Matrix6d::Zero();
  Matrix6d hessian_t_ = Matrix6d::Zero();   // times t
  Matrix6d hessian_tt_ = Matrix6d::Zero();  // times t^2
  Vector6d gradient_ = Vector6d::Zero();
  Vector6d gradient_t_ = Vector6d::Zero();
};

class RollingSolver {
 public:
  RollingSolver(const CameraModel& camera, const CameraModel& sensor, const VelocityPrior& prior,
                const std::vector<PointMeasurement>& measurements)
      : camera_(camera), prior_(prior), measurements_(measurements) {
    // A measured pixel tells its line, which does not depend on the unknowns.
    const ShutterMotion lines(sensor, prior.mean);
    times_s_.reserve(measurements.size());
    for (const PointMeasurement& m : measurements) {
      times_s_.push_back(lines.Time_s(camera.Unproject(m.pixel)));
    }
  }

  // What the depths of points leave open, by the state as it is (see MeasurementNoise).
  void TakeNoise(const RollingState& state) {
    const Eigen::Matrix3d R = state.T_cam_world.rotation().toRotationMatrix();
    noises_.clear();
    noises_.reserve(measurements_.size());
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      const Eigen::Vector3d p_cam = R * measurements_[i].p_world + state.T_cam_world.translation();
      noises_.push_back(NoiseOf(camera_, state.T_cam_world.rotation(),
                                state.velocity.PointLater(times_s_[i], p_cam), measurements_[i]));
    }
  }

  // Squared errors over their variances; infinite behind the camera.
  std::vector<double> Chi2(const RollingState& state) const {
    const Eigen::Matrix3d R = state.T_cam_world.rotation().toRotationMatrix();
    std::vector<double> chi2;
    chi2.reserve(measurements_.size());
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      const Eigen::Vector3d p_cam = R * measurements_[i].p_world + state.T_cam_world.translation();
      const Eigen::Vector3d p_line = state.velocity.PointLater(times_s_[i], p_cam);
      chi2.push_back(p_line.z() <= 0
                         ? HUGE_VAL
                         : noises_[i].Chi2(measurements_[i].pixel - camera_.Project(p_line)));
    }
    return chi2;
  }

  RollingState Minimise(RollingState state, const std::vector<char>& is_inlier, bool robust) const {
    constexpr int kMaxSteps = 10;
    constexpr double kConverged = 1e-6;  // share of the cost
    RollingEquations at = EquationsAt(state, is_inlier, robust);
    double damping = 1e-6;
    for (int i = 0; i < kMaxSteps; ++i) {
      Matrix12d damped = at.hessian;
      damped.diagonal() *= 1 + damping;
      const Vector12d delta = damped.ldlt().solve(at.gradient);
      if (!delta.allFinite()) return state;
      const RollingState moved = MovedBy(state, delta);
      // So short a step is within the reach of the linearisation: what it gains is known.
      if (std::isfinite(at.cost) && delta.dot(at.gradient) < kConverged * at.cost) return moved;
      const RollingEquations at_moved = EquationsAt(moved, is_inlier, robust);
      if (!(at_moved.cost < at.cost)) {
        damping = damping * 100 + 1e-4;
        continue;
      }
      state = moved;
      at = at_moved;
      damping *= 0.1;
    }
    return state;
  }

 private:
  // Inverse variances of the velocity, held ones so large that they do not move.
  Vector6d PriorWeights() const {
    constexpr double kHeld = 1e12;
    const auto weight = [](double sigma) { return sigma > 0 ? 1 / (sigma * sigma) : kHeld; };
    Vector6d weights;
    weights << Eigen::Vector3d::Constant(weight(prior_.angular_sigma_rad_per_s)),
        Eigen::Vector3d::Constant(weight(prior_.linear_sigma_su_per_s));
    return weights;
  }

  Vector6d FromPrior(const RollingState& state) const {
    Vector6d difference;
    difference << state.velocity.angular_rad_per_s - prior_.mean.angular_rad_per_s,
        state.velocity.linear_su_per_s - prior_.mean.linear_su_per_s;
    return difference;
  }

  RollingEquations EquationsAt(const RollingState& state, const std::vector<char>& is_inlier,
                               bool robust) const {
    RollingEquations equations;
    RollingSums sums;
    const Eigen::Matrix3d R = state.T_cam_world.rotation().toRotationMatrix();
    const Eigen::Vector3d& t = state.T_cam_world.translation();
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      if (is_inlier[i] == 0) continue;
      const PointMeasurement& m = measurements_[i];
      const MeasurementNoise& noise = noises_[i];
      const Eigen::Vector3d rotated = R * m.p_world;
      const Eigen::Vector3d p_line = state.velocity.PointLater(times_s_[i], rotated + t);
      if (p_line.z() <= 0) {
        equations.cost = HUGE_VAL;
        continue;
      }
      const Eigen::Vector2d error = m.pixel - camera_.Project(p_line);
      const double chi2 = noise.Chi2(error);
      double weight = noise.inverse_variance;
      if (robust && chi2 > kChi2TwoDof) {  // Huber
        weight *= std::sqrt(kChi2TwoDof / chi2);
        equations.cost += 2 * std::sqrt(kChi2TwoDof * chi2) - kChi2TwoDof;
      } else {
        equations.cost += chi2;
      }
      const Eigen::Matrix2d W = weight * (Eigen::Matrix2d::Identity() -
                                          noise.share * noise.v_px * noise.v_px.transpose());
      // The turn between the middle line and this one is left out: below a degree.
      sums.Add(ProjectionJacobian(camera_, p_line, rotated), W, error, times_s_[i]);
    }
    sums.Fill(t, equations);
    const Vector6d weights = PriorWeights();
    const Vector6d from_prior = FromPrior(state);
    equations.cost += from_prior.cwiseAbs2().dot(weights);
    equations.hessian.diagonal().tail<6>() += weights;
    equations.gradient.tail<6>() -= weights.cwiseProduct(from_prior);
    return equations;
  }

  const CameraModel& camera_;
  const VelocityPrior& prior_;
  const std::vector<PointMeasurement>& measurements_;
  std::vector<double> times_s_;
  std::vector<MeasurementNoise> noises_;
};

PoseAndVelocity OptimiseBoth(const CameraModel& camera, const CameraModel& sensor,
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
    std::vector<double> chi2 = solver.Chi2(state);
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      const bool fits = chi2[i] <= kChi2TwoDof;
      estimate.is_inlier[i] = fits ? 1 : 0;
      estimate.num_inliers += fits ? 1 : 0;
      if (fits) sum_px2 += chi2[i] * measurements[i].sigma_px * measurements[i].sigma_px;
    }
    if (estimate.num_inliers > 0) {
      estimate.reprojection_px = std::sqrt(sum_px2 / estimate.num_inliers);
    }
    estimate.noise_scale = NoiseScaleOf(std::move(chi2));
    if (estimate.num_inliers < kMinPoseInliers) break;
  }
  estimate.T_cam_world = state.T_cam_world;
  return {estimate, state.velocity};
}

// Whether the linear velocity is none that the camera can have, by what is known of it before.
bool IsImpossible(const CameraVelocity& velocity, const VelocityPrior& prior) {
  constexpr double kMaxSigmas = 4;
  return prior.linear_sigma_su_per_s > 0 &&
         (velocity.linear_su_per_s - prior.mean.linear_su_per_s).norm() >
             kMaxSigmas * std::sqrt(3.) * prior.linear_sigma_su_per_s;
}

}  // namespace

PoseAndVelocity OptimisePoseAndVelocity(const CameraModel& camera, const CameraModel& sensor,
                                        const Pose& T_cam_world, const VelocityPrior& prior,
                                        const std::vector<PointMeasurement>& measurements) {
  // Of the measurements that fit with the velocity as it is found.
  constexpr double kMinShareHeld = 0.9;
  PoseAndVelocity found = OptimiseBoth(camera, sensor, T_cam_world, prior, measurements);
  if (!IsImpossible(found.velocity, prior)) return found;
  // Seen from above, a tilt and a climb at tens of metres per second change the image of a plane
  // alike, and errors that the points of a young map have in common decide between them. With the
  // velocity held they are left to the pose, which they tilt by less.
  VelocityPrior held = prior;
  held.linear_sigma_su_per_s = 0;
  PoseAndVelocity with_held = OptimiseBoth(camera, sensor, T_cam_world, held, measurements);
  const bool fits = with_held.pose.num_inliers >= kMinShareHeld * found.pose.num_inliers;
  return fits ? std::move(with_held) : std::move(found);
}

}  // namespace mono3d::tracking
