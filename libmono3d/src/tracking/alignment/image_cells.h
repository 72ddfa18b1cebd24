// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mono3d/geometry/camera_model.h"

namespace mono3d::tracking {

// The cells of an image of each of which tracking follows one point at first: about 600 of 768 x
// 448 and of smaller images, as how well a pose is known depends on how many points there are, and
// not on how large the image is that shows them; more of larger ones.
class ImageCells {
 public:
  explicit ImageCells(const CameraModel& camera)
      : side_px_(Side_px(camera)),
        num_columns_(camera.width / side_px_ + 1),
        num_rows_(camera.height / side_px_ + 1) {}
  std::size_t size() const {
    return static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_);
  }
  // Of a pixel in the image.
  std::size_t Index(const Eigen::Vector2d& pixel) const {
    return static_cast<std::size_t>(static_cast<int>(pixel.y()) / side_px_ * num_columns_ +
                                    static_cast<int>(pixel.x()) / side_px_);
  }

 private:
  static int Side_px(const CameraModel& camera) {
    constexpr double kNumCells = 600;
    constexpr int kLeast_px = 10;  // a little more than a patch: what two share is no news
    constexpr int kMost_px = 24;
    const double area_px = static_cast<double>(camera.width) * camera.height;
    return std::clamp(static_cast<int>(std::lround(std::sqrt(area_px / kNumCells))), kLeast_px,
                      kMost_px);
  }

  int side_px_;
  int num_columns_;
  int num_rows_;
};

}  // namespace mono3d::tracking
