// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/homography.h"
#include "mono3d/geometry/pose.h"
#include "reference/random.h"

namespace mono3d {

// Points in front of two cameras, and where both see them.
struct TwoViewWorld {
  CameraModel camera{.width = 768, .height = 448, .fx = 690, .fy = 692, .cx = 383, .cy = 224};
  Pose T_b_a;
  std::vector<Eigen::Vector3d> p_a;
  std::vector<PointPair> pairs;  // px
};

// `num_points` points that both cameras see: depths 8 to 20, or on a slanted plane. Gaussian noise
// on both pixels; the first `num_outliers` pairs are wrong on purpose.
struct TwoViewWorldOptions {
  int num_points = 200;
  bool planar = false;
  double noise_px = 0;
  int num_outliers = 0;
};
TwoViewWorld MakeTwoViewWorld(const TwoViewWorldOptions& options, std::mt19937& random);

// Angle between the directions of two vectors, in degrees.
double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);
// Rotation from one pose to another, in degrees.
double RotationErrorDeg(const Pose& a, const Pose& b);

}  // namespace mono3d
