// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "synthetic/flight_legs.h"
#include "synthetic/noise.h"
#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

// One channel of unsteadiness: a few swings of seeded rate and phase, standard deviation 1.
class Sway {
 public:
  Sway(const UnsteadinessOptions& options, RandomNumbers& random) {
    for (Swing& swing : swings_) {
      swing.hz = random.Uniform(options.lowest_hz, options.highest_hz);
      swing.phase = random.Uniform(0, 2 * std::numbers::pi);
    }
  }

  double At(double t_s) const {
    double sum = 0;
    for (const Swing& swing : swings_) {
      sum += std::sin(2 * std::numbers::pi * swing.hz * t_s + swing.phase);
    }
    return sum * std::sqrt(2.0 / static_cast<double>(swings_.size()));
  }

 private:
  struct Swing {
    double hz = 0;
    double phase = 0;
  };
  std::array<Swing, 5> swings_{};
};

// The camera's own shift and turn by an unsteady hand.
class Hand {
 public:
  explicit Hand(const UnsteadinessOptions& options)
      : position_m_(options.position_m), rotation_rad_(Radians(options.rotation_deg)) {
    RandomNumbers random(static_cast<std::uint64_t>(options.seed));
    for (int channel = 0; channel < 6; ++channel) sways_.emplace_back(options, random);
  }

  Pose At(double t_s) const {  // T_cam_unsteady
    const Eigen::Vector3d shift(sways_[0].At(t_s), sways_[1].At(t_s), sways_[2].At(t_s));
    const Eigen::Vector3d turn(sways_[3].At(t_s), sways_[4].At(t_s), sways_[5].At(t_s));
    return Pose(RotationExp(rotation_rad_ * turn), position_m_ * shift);
  }

 private:
  double position_m_;
  double rotation_rad_;
  std::vector<Sway> sways_;
};

Eigen::Vector2d UnitVector(double direction_rad) {
  return {std::cos(direction_rad), std::sin(direction_rad)};
}

Pose PoseOf(const Aim& aim) {
  const Eigen::Vector2d ahead = UnitVector(aim.yaw_rad);
  const Eigen::Vector3d right(ahead.y(), -ahead.x(), 0);
  const double c = std::cos(aim.pitch_rad);
  const Eigen::Vector3d forward(c * ahead.x(), c * ahead.y(), -std::sin(aim.pitch_rad));
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(0) = right;
  R_world_cam.col(1) = forward.cross(right);
  R_world_cam.col(2) = forward;
  return Pose(R_world_cam, aim.eye);
}

Aim Moved(const Aim& aim, double turn_rad, const Eigen::Vector3d& shift) {
  const Eigen::AngleAxisd turn(turn_rad, Eigen::Vector3d::UnitZ());
  return {turn * aim.eye + shift, aim.yaw_rad + turn_rad, aim.pitch_rad};
}

constexpr int kNumPathSamples = 200;  // for means over a flight

// The mean of the places on flat ground that the camera looks at. A view near the horizon counts as
// one of 15 degrees below it.
Eigen::Vector2d MeanViewedPlace(const Legs& legs, double height_m, double pitch_rad) {
  const double ahead_m = height_m / std::tan(std::max(pitch_rad, Radians(15)));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 0; i < kNumPathSamples; ++i) {
    const Aim aim = AimAt(legs, Duration(legs) * i / (kNumPathSamples - 1));
    sum += aim.eye.head<2>() + ahead_m * UnitVector(aim.yaw_rad);
  }
  return sum / kNumPathSamples;
}

}  // namespace

struct Flight::Impl {
  Legs legs;
  Hand hand;
  double heading_rad = 0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // of the legs' frame in the world

  Aim WorldAimAt(double t_s) const { return Moved(AimAt(legs, t_s), heading_rad, shift); }
};

Flight::Flight(const FlightOptions& options, const GroundHeightFunction& ground_height) {
  options.Validate();
  const auto impl = std::make_shared<Impl>(Impl{LegsOf(options), Hand(options.unsteadiness)});
  const Eigen::Vector2d target(options.target_x_m, options.target_y_m);
  const bool is_in_circles = options.kind == "orbit" || options.kind == "helix";
  const bool is_about_target = is_in_circles || options.kind == "take_off" ||
                               options.kind == "rocket" || options.kind == "dronie";
  impl->heading_rad = is_in_circles ? 0 : Radians(options.heading_deg);
  impl->shift.head<2>() = target;
  if (!is_about_target) {
    const Eigen::Rotation2Dd turn(impl->heading_rad);
    impl->shift.head<2>() -=
        turn * MeanViewedPlace(impl->legs, options.height_m, Radians(options.pitch_deg));
  }
  if (ground_height && is_about_target) impl->shift.z() = ground_height(target);
  if (ground_height && !is_about_target) {
    double sum = 0;
    for (int i = 0; i < kNumPathSamples; ++i) {
      const double t_s = Duration(impl->legs) * i / (kNumPathSamples - 1);
      sum += ground_height(impl->WorldAimAt(t_s).eye.head<2>());
    }
    impl->shift.z() = sum / kNumPathSamples;
  }
  impl_ = impl;
}

double Flight::duration_s() const { return Duration(impl_->legs); }

Pose Flight::PoseAt(double t_s) const {
  return PoseOf(impl_->WorldAimAt(t_s)) * impl_->hand.At(t_s);
}

Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  constexpr double kVertical = 1e-6;  // sine of the angle to the vertical
  if (!(right.norm() > kVertical)) throw Error("a camera that looks straight down has no horizon");
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(0) = right.normalized();
  R_world_cam.col(1) = forward.cross(right.normalized());
  R_world_cam.col(2) = forward;
  return Pose(R_world_cam, eye);
}

}  // namespace mono3d::synthetic
