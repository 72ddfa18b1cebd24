// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/drift_filter.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <optional>

#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Eigen::Index kClock = 10;

Matrix3d CrossOf(const Vector3d& v) {
  Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

}  // namespace

DriftFilter::DriftFilter(const PositionedPath& path)
    : path_(path), is_left_out_(path.positions.size(), 0) {
  Vector3d middle_m = Vector3d::Zero();
  for (const Similarity& S : path.S_metric_kf) middle_m += S.pose().translation();
  middle_m /= static_cast<double>(path.S_metric_kf.size());
  const Similarity S_middle_metric(1, Pose(Eigen::Quaterniond::Identity(), -middle_m));
  const auto about_middle = [&](std::size_t node) {
    return S_middle_metric * path.S_metric_kf[node];
  };
  steps_.push_back({Eigen::Matrix<double, 7, 1>::Zero(), about_middle(0).pose().translation()});
  for (std::size_t k = 1; k < path.S_metric_kf.size(); ++k) {
    // Where the edge has the keyframe, against where it is.
    const Similarity off =
        about_middle(k - 1) * path.edges[k - 1].S_b_a.Inverse() * about_middle(k).Inverse();
    Step step;
    step.offset << off.pose().translation(), RotationLog(off.pose().rotation()),
        std::log(off.scale());
    step.centre_m = about_middle(k).pose().translation();
    steps_.push_back(step);
  }
  for (const PathPosition& position : path.positions) {
    const Vector3d p_m = path.S_metric_kf[position.node] * position.p_kf;
    const Similarity& S = path.S_metric_kf[position.node];
    residuals_.push_back({p_m - middle_m, position.p_m - p_m,
                          S.pose().rotation() * (S.scale() * position.velocity_kf)});
  }
  double scale = 0;
  for (const Similarity& S : path.S_metric_kf) scale += S.scale();
  shift_m_ = path.shift * scale / static_cast<double>(path.S_metric_kf.size());
}

// A similarity about the keyframe, in terms of one about the middle of the path.
void DriftFilter::AddDrift(const Step& step, const PathNoise& noise, State& state,
                           Covariance& covariance) const {
  state.head<7>() += step.offset;
  const double rotation = noise.drift.rotation_rad * noise.drift.rotation_rad;
  const double scale = noise.drift.log_scale * noise.drift.log_scale;
  const Vector3d& d = step.centre_m;
  const Matrix3d cross = CrossOf(d);
  covariance.block<3, 3>(0, 0) += shift_m_ * shift_m_ * Matrix3d::Identity() +
                                  rotation * cross * cross.transpose() + scale * d * d.transpose();
  covariance.block<3, 3>(0, 3) += rotation * cross;
  covariance.block<3, 3>(3, 0) += rotation * cross.transpose();
  covariance.block<3, 3>(3, 3).diagonal().array() += rotation;
  covariance.block<3, 1>(0, 6) -= scale * d;
  covariance.block<1, 3>(6, 0) -= scale * d.transpose();
  covariance(6, 6) += scale;
}

DriftLikelihood DriftFilter::Run(const PathNoise& noise) const {
  DriftLikelihood result;
  result.is_outlier.assign(path_.positions.size(), 0);
  if (path_.positions.empty()) return result;
  // The start: more than a georeference that was found may be off by, whatever the drift.
  constexpr double kStart_m = 300;
  constexpr double kStartRotation_rad = 0.35;
  constexpr double kStartLogScale = 0.3;
  State state = State::Zero();
  Covariance covariance = Covariance::Zero();
  covariance.diagonal().head<3>().setConstant(kStart_m * kStart_m);
  covariance.diagonal().segment<3>(3).setConstant(kStartRotation_rad * kStartRotation_rad);
  covariance(6, 6) = kStartLogScale * kStartLogScale;
  state[kClock] = path_.clock_offset_s;
  covariance(kClock, kClock) = path_.clock_offset_sigma_s * path_.clock_offset_sigma_s;
  const Eigen::Index num_measured = path_.has_vertical ? 3 : 2;
  Vector3d wander, white, correlation_s;
  for (int axis = 0; axis < 3; ++axis) {
    const PositionNoise& of_axis = axis < 2 ? noise.horizontal : noise.vertical;
    wander[axis] = of_axis.wander_m * of_axis.wander_m;
    white[axis] = of_axis.white_m * of_axis.white_m;
    correlation_s[axis] = of_axis.correlation_s;
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) covariance(7 + axis, 7 + axis) = wander[axis];
  // One in a hundred, anywhere within some hundred metres: what they cost must not depend on how
  // well the others are known, or small errors and nothing but outliers would be likeliest.
  constexpr double kOutlier_m = 100;
  constexpr double kOutlierShare = 0.01;
  const double log_root_two_pi = std::log(2 * std::numbers::pi) / 2;
  Eigen::Matrix<double, 11, 3> gain_of;
  std::size_t next = 0;
  std::optional<double> last_s;  // of a position of the camera
  for (std::size_t node = 0; node < steps_.size(); ++node) {
    if (node > 0) AddDrift(steps_[node], noise, state, covariance);
    for (; next < path_.positions.size() && path_.positions[next].node == node; ++next) {
      const PathPosition& position = path_.positions[next];
      const bool is_known_point = position.covariance_m2.has_value();
      const Eigen::Index num_axes = is_known_point ? 3 : num_measured;
      const double step_s = is_known_point ? 0 : position.time_s - last_s.value_or(position.time_s);
      if (!is_known_point) last_s = position.time_s;
      for (Eigen::Index axis = 0; !is_known_point && axis < num_axes; ++axis) {
        const double kept = correlation_s[axis] > 0 ? std::exp(-step_s / correlation_s[axis]) : 0;
        const Eigen::Index at = 7 + axis;
        state[at] *= kept;
        covariance.row(at) *= kept;
        covariance.col(at) *= kept;
        covariance(at, at) += (1 - kept * kept) * wander[axis];
      }
      Eigen::Matrix<double, 3, 11> by_state = Eigen::Matrix<double, 3, 11>::Zero();
      const Residual& residual = residuals_[next];
      by_state.leftCols<3>().setIdentity();
      by_state.block<3, 3>(0, 3) = -CrossOf(residual.arm_m);
      by_state.col(6) = residual.arm_m;
      if (!is_known_point) {
        by_state.block<3, 3>(0, 7).setIdentity();
        by_state.col(kClock) = residual.velocity_m_per_s;
      }
      Vector3d innovation = residual.r_m - by_state * state;
      const Eigen::Matrix<double, 11, 3> mixed = covariance * by_state.transpose();
      Matrix3d expected = by_state * mixed;
      if (is_known_point) {
        expected += *position.covariance_m2;
      } else {
        expected.diagonal() += white;
      }
      if (num_axes == 2) {  // z says nothing
        expected.row(2).setZero();
        expected.col(2).setZero();
        expected(2, 2) = 1;
        innovation.z() = 0;
      }
      const Eigen::LLT<Matrix3d> root(expected);
      const Vector3d whitened = root.matrixL().solve(innovation);
      const double chi2 = whitened.squaredNorm();
      const Matrix3d lower = root.matrixL();
      const double gate = num_axes == 3 ? kChi2ThreeDofSure : kChi2TwoDofSure;
      if (!(chi2 <= gate) || is_left_out_[next] != 0) {
        result.is_outlier[next] = 1;
        result.log_likelihood +=
            std::log(kOutlierShare) -
            static_cast<double>(num_axes) * (std::log(kOutlier_m) + log_root_two_pi);
        continue;
      }
      result.log_likelihood -= chi2 / 2 + lower.diagonal().array().log().sum() +
                               static_cast<double>(num_axes) * log_root_two_pi;
      gain_of = root.solve(mixed.transpose()).transpose();
      if (num_axes == 2) gain_of.col(2).setZero();
      state += gain_of * innovation;
      covariance -= gain_of * expected * gain_of.transpose();
    }
  }
  return result;
}

}  // namespace mono3d::tracking
