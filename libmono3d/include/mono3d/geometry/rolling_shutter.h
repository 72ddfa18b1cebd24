// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace MONO3D_EXPORT mono3d {

// How a camera moves at the moment of an image: a time t later, a point at p_cam is at
// Exp(t * angular + t^2 / 2 * angular2) * p_cam + t * linear + t^2 / 2 * linear2 in the axes of the
// camera of that time.
struct CameraVelocity {
  Eigen::Vector3d angular_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear_su_per_s = Eigen::Vector3d::Zero();
  // How both change: a drone shakes several times a second.
  Eigen::Vector3d angular_rad_per_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear_su_per_s2 = Eigen::Vector3d::Zero();

  bool operator==(const CameraVelocity&) const = default;
  // From the camera's axes now into those `time_s` later.
  Pose T_later_now(double time_s) const;
  // T_later_now(time_s) * p_cam, for many points of different times.
  Eigen::Vector3d PointLater(double time_s, const Eigen::Vector3d& p_cam) const;
  // Lengths have been multiplied.
  void Rescale(double ratio) {
    linear_su_per_s *= ratio;
    linear_su_per_s2 *= ratio;
  }
};

// Of a camera that has moved by T_later_earlier in `duration_s`; zero where that is 0. Both may be
// negative in time.
CameraVelocity VelocityOf(const Pose& T_later_earlier, double duration_s);

// Where a camera is `time_s` after the moment in question; negative: before.
struct LaterPose {
  Pose T_later_now;
  double time_s = 0;
};

// How a camera moves at a moment, by the polynomial in time through it and the poses around it, one
// or more. `unit_s`: about the time between them. Nothing where two are of one time.
std::optional<CameraVelocity> VelocityThrough(std::span<const LaterPose> around, double unit_s);

// How the scene moves through an image while the lines of a rolling shutter are read one after the
// other. The pose of the image is that of its middle line; within the readout the motion is as
// smooth as CameraVelocity has it. Cheap to copy; a default one has a global shutter.
class ShutterMotion {
 public:
  ShutterMotion() = default;
  // `sensor`: the camera that took the image, with its distortion: lines are straight on it alone.
  ShutterMotion(const CameraModel& sensor, const CameraVelocity& velocity);

  // Nothing to correct: a global shutter, or a camera that stands still.
  bool IsStill() const { return is_still_; }
  const CameraVelocity& velocity() const { return velocity_; }
  const CameraModel& sensor() const { return sensor_; }

  // When the line is read on which the sensor shows the ray (z > 0), in s after the middle line.
  double Time_s(const Eigen::Vector3d& ray) const;
  // From the camera's frame at the middle line into that at the line that a ray is on.
  Pose T_line_cam(const Eigen::Vector3d& ray) const;
  // A point of the camera's frame at the middle line, in that of the line that shows the point.
  Eigen::Vector3d AtItsLine(const Eigen::Vector3d& p_cam) const;
  // The same at the time of the line that a ray is on.
  Eigen::Vector3d AtLineOf(const Eigen::Vector3d& ray, const Eigen::Vector3d& p_cam) const {
    return is_still_ ? p_cam : velocity_.PointLater(Time_s(ray), p_cam);
  }

  // Where an image of `camera` (free of distortion, beside `sensor`) shows p_cam with its lines
  // read one after the other.
  Eigen::Vector2d Project(const CameraModel& camera, const Eigen::Vector3d& p_cam) const {
    return camera.Project(is_still_ ? p_cam : AtItsLine(p_cam));
  }
  // Where it would show a point that it shows at `pixel`, were all lines read with the middle one.
  Eigen::Vector2d AtMiddleLine(const CameraModel& camera, const Eigen::Vector2d& pixel,
                               const Eigen::Vector3d& p_cam) const;

  // Of a camera that only turns.
  ShutterMotion WithoutLinear() const {
    CameraVelocity turning = velocity_;
    turning.Rescale(0);
    return {sensor_, turning};
  }
  // Lengths have been multiplied.
  void Rescale(double ratio) { velocity_.Rescale(ratio); }

 private:
  CameraModel sensor_;
  CameraVelocity velocity_;
  bool is_still_ = true;
};

}  // namespace mono3d
