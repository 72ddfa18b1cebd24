// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

// The surface of a scene that a flight has seen, thinned to one point in each cell of a grid over
// the world. Every point is the hit of one pixel's ray, not a mean, so that it lies on the surface;
// of all hits in a cell that which is nearest to the cell's middle stays. What moves is left out.
class TrueCloud {
 public:
  // Throws Error unless both are above 0. Hits beyond `max_depth_m` (z) are left out.
  explicit TrueCloud(double voxel_m, double max_depth_m);
  ~TrueCloud();
  TrueCloud(TrueCloud&&) noexcept;
  TrueCloud& operator=(TrueCloud&&) noexcept;

  // Adds what the camera sees, one ray for the centre of each pixel. `bgr` (CV_8UC3, of the
  // camera's size) gives the colours; the camera is without distortion.
  void Add(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
           const cv::Mat& bgr);

  // With normals (towards the camera that saw the point), colours and, as observations, the number
  // of images that hit the cell. In an order of place, whatever order the images came in.
  PointCloud Build() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d::synthetic
