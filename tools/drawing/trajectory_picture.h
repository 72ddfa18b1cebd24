// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

#include "mono3d/evaluation/trajectory_error.h"
#include "mono3d/geometry/stamped_pose.h"

namespace mono3d::tools {

struct TrajectoryPictureOptions {
  int width_px = 960;
  int height_px = 720;
  std::string unit = "m";  // of the truth, for axes and legend
  std::string title = {};
};

// The estimate over the truth, seen from above: along the axis that the true positions spread
// least in (for a straight flight along the mean upward direction of the camera). CV_8UC3 (BGR).
// The truth is a dashed grey line with a mark at its start, the estimate is coloured by its
// position error, with a colour bar. Both axes have one scale. `truth` are the poses that `error`
// was computed from. Throws Error when the picture is smaller than 320x240 or there is no pose.
cv::Mat TrajectoryPicture(const TrajectoryError& error, std::span<const StampedPose> truth,
                          const TrajectoryPictureOptions& options = {});

}  // namespace mono3d::tools
