// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "synthetic/render_options.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

// Where the camera is at one moment.
struct Instant {
  Eigen::Vector3f origin;
  Eigen::Matrix3f R_world_cam;
  float t_s = 0;
};
Instant InstantOf(const Pose& T_world_cam, double t_s);

// A ray of a pixel: where in the pixel, when in the exposure, and its share of the pixel's light.
struct PixelSample {
  Eigen::Vector2f shift_px;  // from the pixel's centre
  int slice = 0;             // of the exposure
  float weight = 0;
};

// The rays of each pixel, spread over the pixel's area and over the time that the shutter is open.
// Both spreads are centred and independent of each other, so that nothing is shifted.
struct ShutterPlan {
  int num_slices = 1;
  std::vector<PixelSample> samples;
  // Of each line, `num_slices` each, in the order of the pixels; lines all alike have one.
  std::vector<Instant> instants;

  const Instant& At(int x, int y, int slice) const {
    const int line = lines == Lines::kRows ? y : lines == Lines::kColumns ? x : 0;
    return instants[static_cast<std::size_t>(line) * static_cast<std::size_t>(num_slices) +
                    static_cast<std::size_t>(slice)];
  }
  // What is read at one time: a rolling shutter's rows, or its columns where the sensor is turned.
  enum class Lines { kAll, kRows, kColumns } lines = Lines::kAll;
};
ShutterPlan PlanShutter(const Scene& scene, const CameraModel& camera, const Shot& shot,
                        const RenderOptions& options);

}  // namespace mono3d::synthetic
