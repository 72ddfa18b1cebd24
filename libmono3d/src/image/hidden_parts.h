// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d {

// Parts of images that do not show the scene, whatever they show, and the same in all of them. Who
// looks for corners, patches or depth would have to know of them everywhere; so they are filled
// with what is around, smoothly, where there is nothing to be found.
class HiddenParts {
 public:
  HiddenParts() = default;
  // CV_8UC1, not 0 where the scene is hidden.
  explicit HiddenParts(const cv::Mat& hidden);

  bool IsEmpty() const { return parts_.empty(); }
  // `bgr` has the size of the mask and is CV_8UC3. Gives a copy where anything is filled.
  cv::Mat Fill(const cv::Mat& bgr) const;

 private:
  struct Part {
    cv::Rect area;   // with what is around
    cv::Mat shown;   // CV_32FC1 of that: 0 where hidden, 1 elsewhere
    cv::Mat hidden;  // CV_8UC1
  };
  cv::Size size_;
  std::vector<Part> parts_;
};

}  // namespace mono3d
