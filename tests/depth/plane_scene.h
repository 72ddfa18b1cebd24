// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "mono3d/image/image_bundle.h"

namespace mono3d {

// A textured, tilted plane seen by cameras on a line: every depth is known in closed form.
struct PlaneScene {
  Eigen::Vector3d plane{-0.3, -0.2, 1};  // z = 2 + 0.3 x + 0.2 y, before scaling: plane.p = 2
  CameraModel camera{.width = 160, .height = 96, .fx = 150, .fy = 150, .cx = 79.5, .cy = 47.5};
  double scale = 1;                       // of the world
  double baseline = 0.2;                  // between neighbours, before scaling; the plane is 2 away
  Eigen::Vector3d direction{1, 0.02, 0};  // of flight, times the baseline
  double contrast = 1;                    // of the texture; 0: none
  int num_images = 5;
  int blank_px = 0;  // side of a square without texture in the middle of the reference, about
  bool with_sparse_depths = true;

  ImageBundle Bundle() const;
  // CV_32FC1, of the reference.
  cv::Mat TrueDepth() const;
};

// The same bundle with the picture of image `index` turned clockwise by quarters, as by a camera
// that is held turned. An odd number of them needs square pictures.
void TurnImage(std::size_t index, unsigned quarter_turns, ImageBundle& bundle);

}  // namespace mono3d
