// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/frame.h"
#include "reference/random.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

CameraModel SmallCamera();  // 384x224, 58 degrees wide

// A picture full of detail at all scales, 8-bit grey.
cv::Mat TexturedPicture(int width, int height, unsigned seed);

// A camera at `eye` that looks at `target`; z is up in the world.
Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

// Textured ground, the plane z = 0, with or without houses (boxes), ray-cast.
class TexturedGround {
 public:
  explicit TexturedGround(bool with_houses);
  cv::Mat Render(const CameraModel& camera, const Pose& T_world_cam) const;  // CV_8UC3
  // Through the camera's rolling shutter: each line at its own time, the middle one at `time_s`.
  cv::Mat RenderRolling(const CameraModel& camera, const std::function<Pose(double)>& T_world_cam,
                        double time_s) const;

 private:
  struct Box {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
  };
  std::vector<Box> boxes_;
  cv::Mat texture_;
};

struct Sequence {
  std::vector<Frame> frames;
  std::vector<Pose> T_world_cam;  // the truth
};

// A sideways flight over the ground at height 10, looking obliquely down, at 10 fps.
Sequence FlyOver(const TexturedGround& ground, int num_frames);

// The same way at 30 frames a second, the view swinging and shaking, through the shutter of
// `sensor` (without distortion); the truth is that of the middle lines.
Sequence FlyUnsteadily(const TexturedGround& ground, const CameraModel& sensor, int num_frames);

Frame BlackFrame(std::int64_t index);

// A view with one feature at each pixel, all with descriptors of their own; those of the same
// number in two views are alike.
View MakeView(const CameraModel& camera, const std::vector<Eigen::Vector2d>& pixels);

}  // namespace mono3d::tracking
