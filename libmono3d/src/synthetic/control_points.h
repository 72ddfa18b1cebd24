// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

// Where an image shows a point.
struct TrueMark {
  int frame = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // as taken: with distortion and readout
};

// A point on a surface that stands still, and faces up: what a survey would mark on the ground.
struct TrueControlPoint {
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  std::vector<TrueMark> marks;
};

// How a flight is filmed.
struct FilmedFlight {
  CameraModel camera;  // with its shutter
  int num_frames = 0;
  // `late_s`: after the middle line is read.
  std::function<Pose(int frame, double late_s)> T_world_cam_at;
};

// Up to `count` points that at least three images show, taken from frames evenly over the flight;
// of each at most 30 marks, evenly over the images that show it. Nothing is drawn: the same flight
// has the same points.
std::vector<TrueControlPoint> ControlPointsOf(const Scene& scene, const FilmedFlight& flight,
                                              int count);

}  // namespace mono3d::synthetic
