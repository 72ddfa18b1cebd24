// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/alignment/octaves.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace mono3d::tracking {

Octaves BuildOctaves(const cv::Mat& grey) {
  constexpr int kMinSide = 24;  // px, of the coarsest octave: a patch of 21 fits
  Octaves octaves = {grey};
  while (static_cast<int>(octaves.size()) < kNumOctaves &&
         std::min(octaves.back().rows, octaves.back().cols) >= 2 * kMinSide) {
    // Its pixel (x, y) is centred at (2x, 2y).
    cv::Mat half;
    cv::pyrDown(octaves.back(), half);
    octaves.push_back(half);
  }
  return octaves;
}

}  // namespace mono3d::tracking
