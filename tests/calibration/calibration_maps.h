// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

// Made-up maps from which cameras are learned: poses and points are the true ones, observed through
// a camera with noise.
inline constexpr double kNoise_px = 0.1;

CameraModel TrueCamera();
CameraModel SecondCamera();
// Knows the image size alone.
CameraPrior UnknownCamera();

enum class Way { kOrbit, kStrip };

// 12 views of 300 points with relief: an orbit that looks down obliquely, or a straight strip that
// looks straight down on flat ground.
SparseModel MakeMap(const CameraModel& camera, Way way, unsigned seed, double sway_of_strip = 0);
// The same through a rolling shutter, the camera turning and flying on differently in each image.
SparseModel MakeRollingMap(const CameraModel& camera, unsigned seed, Way way = Way::kOrbit,
                           double sway_of_strip = 0);
// As a tracker gives it that takes the images to be another camera's: with poses and points that
// agree with the pixels, and velocities that move the images as the camera's do.
SparseModel TrackedWith(const CameraModel& other, const SparseModel& map);
// What a survey of flat ground shows: 24 views straight down, from two heights.
SparseModel MakeBlock(const CameraModel& camera, unsigned seed, double higher = 2);
// Every `every`-th of the orbit's images is the second camera's.
SparseModel MakeMapOfTwo(int every, unsigned seed);
// Of the images, in axes that are turned, shifted and of five times the unit.
CameraPositions MeasurePositions(const SparseModel& map, double sigma_m);

}  // namespace mono3d::calibration
