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

  // The point at z = 1 on the line of sight through pixel (x, y), shifted by less than a pixel.
  Eigen::Vector3f Direction(int x, int y, const Eigen::Vector2f& shift_px) const {
    const PixelSight& sight = sights_[static_cast<std::size_t>(y) * width_ + x];
    const Eigen::Vector2f point = sight.point + sight.per_pixel * shift_px;
    return {point.x(), point.y(), 1};
  }

 private:
  struct PixelSight {
    Eigen::Vector2f point;
    Eigen::Matrix2f per_pixel;  // how the point moves with the pixel
  };
  std::size_t width_;
  std::vector<PixelSight> sights_;
};

}  // namespace mono3d::synthetic
