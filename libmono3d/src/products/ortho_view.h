// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <optional>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d {

// An image as a source of an orthophoto: where it shows a place, and how well.
class OrthoView {
 public:
  OrthoView(const CameraModel& camera, const Pose& T_world_cam);

  struct Sight {
    Eigen::Vector2f pixel;  // in the image as it was taken
    float quality = 0;      // above 0
  };
  // Nothing where the image does not show the place. In axes and units of the model, z up.
  std::optional<Sight> See(const Eigen::Vector3d& p_world) const;

  // False where the image shows nothing of a ball.
  bool MaySee(const Eigen::Vector3d& p_world, double radius) const;

  const Eigen::Vector3d& centre() const { return centre_; }
  // How many pixels an edge of that length takes up, straight below.
  double PixelsPer(double length, const Eigen::Vector3d& p_world) const;

 private:
  CameraModel camera_;
  Eigen::Matrix3d rotation_;  // world to camera
  Eigen::Vector3d centre_;    // in the world
  double min_axis_cosine_;    // beyond that angle to the axis the lens folds back
  double focal_px_;
};

}  // namespace mono3d
