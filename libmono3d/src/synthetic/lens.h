// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono3d/geometry/camera_model.h"

namespace mono3d::synthetic {

// Pixels of a camera with distortion to lines of sight: the exact inverse of the distortion, found
// once for each pixel's centre.
class Lens {
 public:
  // Throws Error when the distortion cannot be inverted over the whole image.
  explicit Lens(const CameraModel& camera);

  // Along the line of sight through pixel (x, y), shifted by less than a pixel: with z = 1, of a
  // fisheye lens of length 1.
  Eigen::Vector3f Direction(int x, int y, const Eigen::Vector2f& shift_px) const {
    const PixelSight& sight = sights_[static_cast<std::size_t>(y) * width_ + x];
    return sight.direction + sight.per_pixel * shift_px;
  }

 private:
  struct PixelSight {
    Eigen::Vector3f direction;
    Eigen::Matrix<float, 3, 2> per_pixel;  // how the direction moves with the pixel
  };

  PixelSight& At(int x, int y) {
    return sights_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
  }
  void FindBrown(const CameraModel& camera);
  void FindFisheye(const CameraModel& camera);

  std::size_t width_;
  std::vector<PixelSight> sights_;
};

}  // namespace mono3d::synthetic
