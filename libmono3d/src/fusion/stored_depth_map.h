// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>

#include "mono3d/image/depth_map.h"

namespace mono3d {

// A depth map put by, in two fifths of its memory: depths in 65535 steps of their logarithm from
// the nearest to the farthest, normals to about a degree (octahedral, 8 bits a side), confidences
// in 255 steps, the image as it is. Less than the noise of any depth map is lost.
class StoredDepthMap {
 public:
  StoredDepthMap() = default;
  explicit StoredDepthMap(const DepthMap& map);

  DepthMap Restore() const;
  std::size_t num_bytes() const;

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

  // What is no image.
  DepthMap frame;  // its images are empty, but for bgr

 private:
  float log_nearest_ = 0;
  float log_step_ = 0;
  cv::Mat depth_;       // CV_16UC1, 0: none
  cv::Mat normal_;      // CV_8SC2, both 0: none
  cv::Mat confidence_;  // CV_8UC1
};

}  // namespace mono3d
