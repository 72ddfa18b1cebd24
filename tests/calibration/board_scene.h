// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <random>
#include <vector>

#include "mono3d/calibration/board_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d {

// A wide lens that is not centred: 640x480.
CameraModel BoardCamera();
// The same of 130 degrees across.
CameraModel FisheyeBoardCamera();

// A board in the plane z = 0, its squares one unit wide, ray-cast through a lens with distortion.
class BoardScene {
 public:
  BoardScene(const CalibrationBoard& board, const CameraModel& camera);

  // Shown from `T_cam_board`, a little out of focus and with noise: CV_8UC3.
  cv::Mat Render(const Pose& T_cam_board, std::mt19937& random) const;

  // The board somewhere in the image, `tilt_deg` off its plane at most.
  Pose RandomPose(std::mt19937& random, double tilt_deg) const;
  std::vector<cv::Mat> RenderMany(int num_images, double tilt_deg, unsigned seed) const;

 private:
  CameraModel camera_;
  int columns_;  // squares
  int rows_;
  cv::Mat picture_;  // CV_8UC1, with a white border of one square
  cv::Mat rays_;     // CV_32FC3, of parts of pixels
};

}  // namespace mono3d
