// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "fusion/tracked_model.h"
#include "mono3d/geometry/point_cloud.h"

namespace mono3d {

// Ground with a house of pitched roof on it, in a texture that a camera some 10 su away resolves.
// World: z up; the house stands at the origin, 4 su long.
struct HouseScene {
  bool with_house = true;    // else flat ground
  bool with_texture = true;  // else all grey
  double world_scale = 1;    // the same scene, larger
};

// 144x96 pixels, about 60 degrees wide.
CameraModel HouseCamera();

// The exact depth map from a camera on an orbit around the house, 10 su away and 6 su up,
// `angle_deg` from the y axis.
TrackedMap HouseView(const HouseScene& scene, double angle_deg);

// The exact depth map from anywhere; the pose is that of the scene at `world_scale` 1.
TrackedMap HouseViewFrom(const HouseScene& scene, const Pose& T_world_cam);

// A camera some 10 su away from, and 6 su above, a place of the ground, to which it looks along
// the y axis; x and y of the place.
Pose PoseOver(double x_su, double y_su);

// What a tracker of another opinion would have delivered: the pose moved by rotation and
// translation in the camera's frame (translation in shares of 10 su, times the scene's scale),
// depths and baseline divided by `scale`.
TrackedMap Misplaced(const TrackedMap& map, const Eigen::Vector3d& rotation_rad,
                     const Eigen::Vector3d& translation_su, double scale);

// How far apart two poses show the scene, in pixels of HouseCamera, at 10 su times `world_scale`.
double ImageDistance_px(const Pose& a, const Pose& b, double world_scale = 1);

// As seen from where the truth is known: the share of the surfels in view that stand before the
// true surface by more than a twentieth of its depth, which only a false one does. 1 where none is
// in view.
double FalseShare(const PointCloud& model, const std::vector<TrackedMap>& truth);

}  // namespace mono3d
