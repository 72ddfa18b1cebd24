// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/rolling_shutter.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstddef>

#include "mono3d/geometry/distortion.h"

namespace mono3d {

CameraVelocity VelocityOf(const Pose& T_later_earlier, double duration_s) {
  if (duration_s == 0) return {};
  CameraVelocity velocity;
  velocity.angular_rad_per_s = RotationLog(T_later_earlier.rotation()) / duration_s;
  velocity.linear_su_per_s = T_later_earlier.translation() / duration_s;
  return velocity;
}

Pose CameraVelocity::T_later_now(double time_s) const {
  const double half = time_s * time_s / 2;
  return {RotationExp(time_s * angular_rad_per_s + half * angular_rad_per_s2),
          time_s * linear_su_per_s + half * linear_su_per_s2};
}

Eigen::Vector3d CameraVelocity::PointLater(double time_s, const Eigen::Vector3d& p_cam) const {
  const double half = time_s * time_s / 2;
  const Eigen::Vector3d omega = time_s * angular_rad_per_s + half * angular_rad_per_s2;
  const double angle2 = omega.squaredNorm();
  // Rodrigues' formula: sin(x) / x and (1 - cos(x)) / x^2, up to .3 rad by their series, which are
  // exact to 1e-10 there.
  constexpr double kMaxOfSeries = 0.1;  // rad^2
  double by_sine;
  double by_cosine;
  if (angle2 < kMaxOfSeries) {
    by_sine = 1 - angle2 / 6 * (1 - angle2 / 20 * (1 - angle2 / 42));
    by_cosine = 0.5 - angle2 / 24 * (1 - angle2 / 30 * (1 - angle2 / 56));
  } else {
    const double angle = std::sqrt(angle2);
    by_sine = std::sin(angle) / angle;
    by_cosine = (1 - std::cos(angle)) / angle2;
  }
  const Eigen::Vector3d across = omega.cross(p_cam);
  return p_cam + by_sine * across + by_cosine * omega.cross(across) + time_s * linear_su_per_s +
         half * linear_su_per_s2;
}

std::optional<CameraVelocity> VelocityThrough(std::span<const LaterPose> around, double unit_s) {
  if (around.empty()) return std::nullopt;
  // Rotation vector and translation, each by powers of the time; at the moment itself both are
  // zero.
  const auto size = static_cast<Eigen::Index>(around.size());
  Eigen::MatrixXd powers(size, size);
  Eigen::MatrixXd ways(size, 6);
  for (Eigen::Index i = 0; i < size; ++i) {
    const LaterPose& to = around[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < size; ++k) powers(i, k) = std::pow(to.time_s / unit_s, k + 1);
    ways.row(i) << RotationLog(to.T_later_now.rotation()).transpose(),
        to.T_later_now.translation().transpose();
  }
  const Eigen::MatrixXd by_power = powers.partialPivLu().solve(ways);
  if (!by_power.allFinite()) return std::nullopt;  // two poses of one time
  CameraVelocity velocity;
  velocity.angular_rad_per_s = by_power.row(0).head<3>() / unit_s;
  velocity.linear_su_per_s = by_power.row(0).tail<3>() / unit_s;
  if (size > 1) {
    velocity.angular_rad_per_s2 = 2 * by_power.row(1).head<3>() / (unit_s * unit_s);
    velocity.linear_su_per_s2 = 2 * by_power.row(1).tail<3>() / (unit_s * unit_s);
  }
  return velocity;
}

ShutterMotion::ShutterMotion(const CameraModel& sensor, const CameraVelocity& velocity)
    : sensor_(sensor),
      velocity_(velocity),
      is_still_(sensor.shutter.IsGlobal() || velocity == CameraVelocity()) {}

double ShutterMotion::Time_s(const Eigen::Vector3d& ray) const {
  return sensor_.shutter.readout_s *
         LineShare(sensor_, ProjectDistorted(sensor_, ray), sensor_.shutter.reads_columns);
}

Pose ShutterMotion::T_line_cam(const Eigen::Vector3d& ray) const {
  return is_still_ ? Pose() : velocity_.T_later_now(Time_s(ray));
}

Eigen::Vector3d ShutterMotion::AtItsLine(const Eigen::Vector3d& p_cam) const {
  if (is_still_) return p_cam;
  // The line follows from the point and the point from the line. What is left falls with each round
  // by the share of the image that the scene moves through during the readout: some percent.
  constexpr int kRounds = 2;
  Eigen::Vector3d p_line = p_cam;
  for (int i = 0; i < kRounds && p_line.z() > 0; ++i) p_line = AtLineOf(p_line, p_cam);
  return p_line;
}

Eigen::Vector2d ShutterMotion::AtMiddleLine(const CameraModel& camera, const Eigen::Vector2d& pixel,
                                            const Eigen::Vector3d& p_cam) const {
  if (is_still_) return pixel;
  const Eigen::Vector3d p_line = AtLineOf(camera.Unproject(pixel), p_cam);
  if (p_line.z() <= 0 || p_cam.z() <= 0) return pixel;
  return pixel - (camera.Project(p_line) - camera.Project(p_cam));
}

}  // namespace mono3d
