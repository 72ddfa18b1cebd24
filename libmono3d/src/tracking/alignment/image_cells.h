// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mono3d/geometry/camera_model.h"

namespace mono3d::tracking {

// The cells of an image of each of which tracking follows one point: about 600 in 768 x 448.
class ImageCells {
 public:
  explicit ImageCells(const CameraModel& camera)
      : num_columns_(camera.width / kCell + 1), num_rows_(camera.height / kCell + 1) {}
  std::size_t size() const {
    return static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_);
  }
  // Of a pixel in the image.
  std::size_t Index(const Eigen::Vector2d& pixel) const {
    return static_cast<std::size_t>(static_cast<int>(pixel.y()) / kCell * num_columns_ +
                                    static_cast<int>(pixel.x()) / kCell);
  }

 private:
  static constexpr int kCell = 24;  // px: a little more than a patch
  int num_columns_;
  int num_rows_;
};

}  // namespace mono3d::tracking
