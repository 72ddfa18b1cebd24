// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/image/frame.h"
#include "tracking/photos/descriptor_products.h"

namespace mono3d::tracking {

// What a photo shows, the largest structures first.
struct PhotoFeatures {
  std::vector<Eigen::Vector2d> pixels;               // in the photo
  std::vector<double> sigma_px;                      // standard deviation of each, in x and in y
  std::vector<std::array<std::uint8_t, 3>> colours;  // red, green, blue
  DescriptorMatrix descriptors;
  std::uint64_t digest = 0;  // of all descriptors: photos are told apart by what they show

  std::size_t size() const { return pixels.size(); }
};

// SIFT (Lowe 2004), about `num_features` of it, with the Hellinger kernel (Arandjelovic and
// Zisserman 2012), on an image whose longer side has no more than `max_side_px` pixels. A dark
// image has those of a bright one, as far as noise allows.
PhotoFeatures ExtractPhotoFeatures(const cv::Mat& bgr, int num_features, int max_side_px);
// Of the frame's content, with the pixels of the whole frame.
PhotoFeatures ExtractPhotoFeatures(const Frame& frame, int num_features, int max_side_px);

}  // namespace mono3d::tracking
