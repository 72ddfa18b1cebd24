// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

struct RenderOptions {
  int samples_per_side = 2;      // samples a pixel, squared
  double exposure = 1;           // brightness factor
  double noise_grey_levels = 0;  // standard deviation of the image noise, 0 to 255
  int noise_seed = 0;            // one for each image, else all have the same noise
  bool with_depth = true;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

struct Rendering {
  cv::Mat bgr;    // CV_8UC3
  cv::Mat depth;  // CV_32FC1, z-depth in metres on the ray of the pixel's centre; 0: sky
};

// What a camera without distortion sees: matt surfaces under sun and sky. The same arguments give
// the same bytes, on any number of threads.
Rendering Render(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
                 const RenderOptions& options = {});

}  // namespace mono3d::synthetic
