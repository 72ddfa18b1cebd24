// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/render_options.h"
#include "synthetic/scene.h"

namespace mono3d::synthetic {

struct Rendering {
  cv::Mat bgr;          // CV_8UC3
  cv::Mat depth;        // CV_32FC1, z-depth in metres on the ray of the pixel's centre; 0: sky
  double exposure = 1;  // factor on the scene's light, before vignetting, noise and tone curve
};

// What the camera sees. The image has the camera's distortion, rolling shutter, blur and noise; the
// depth has none of them: it is that of DepthCamera(camera) at the pose of t_s. The same arguments
// give the same bytes, on any number of threads.
Rendering Render(const Scene& scene, const CameraModel& camera, const Shot& shot,
                 const RenderOptions& options = {});
// By a camera that stands still, at time 0.
Rendering Render(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
                 const RenderOptions& options = {});

// Linear light, CV_32FC3 (blue, green, red), before the sensor's exposure, noise and tone curve.
cv::Mat RenderRadiance(const Scene& scene, const CameraModel& camera, const Shot& shot,
                       const RenderOptions& options = {});

// The camera without distortion to which the Undistorter takes the images of `camera`: the camera
// itself when it has no distortion. True depth belongs to its pixels.
CameraModel DepthCamera(const CameraModel& camera);

// When the shutter of any row is open, for Scene::SetTimeSpan.
struct TimeSpan {
  double begin_s = 0;
  double end_s = 0;
};
TimeSpan ShutterSpan(const SensorOptions& options, double t_s);

}  // namespace mono3d::synthetic
