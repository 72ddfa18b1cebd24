// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

namespace mono3d {

// What the sweep found on a level of the pyramid, CV_32FC1.
struct CoarseMatches {
  int level = 0;          // its halvings
  double step = 0;        // between its planes, 1/su
  cv::Mat winners;        // inverse depth of the best plane, 1/su; 0: none
  cv::Mat uniqueness;     // of that, 0 to 1
  cv::Mat inverse_depth;  // median of the winners, 1/su; 0: none
};

struct CoarseMatchesInput {
  std::span<const CoarseMatches> levels;  // finer ones first
  cv::Mat depth;                          // CV_32FC1, su, at full resolution; 0: not matched
  cv::Mat response;                       // CV_32SC1, of the DoG filter, at full resolution
  double min_response = 0;                // mean of a window that has texture, in the same unit
  float min_uniqueness = 0;               // of a winner that is clear
  int min_support = 0;                    // clear winners of 5x5 that agree with their median
};

// Of cells (image_cells.h) that were matched on a coarser level of the pyramid alone the inverse
// depth (1/su), the step between planes of that level (1/su), and the confidence, CV_32FC3; 0:
// none. Crowns of trees, shrubs and rubble seen under wide angles are like that: no two images show
// the same leaves, though they do show the same branches.
//
// A coarse pixel counts where
// - in its window there is texture, yet most of the pixels were not matched, though some were:
//   narrower holes are edges and occlusions, which are no better known on a coarser level, and
//   where there is no texture or no overlap nothing is known on any level;
// - those that were matched lie on it, within two of its planes, for the greater part;
// - as many winners around it as are asked for on the finest level are clear and agree with it.
//
// The confidence is that of an expected error (surface.comp): the median difference of what was
// matched in the window.
cv::Mat FindCoarseMatches(const CoarseMatchesInput& input);

}  // namespace mono3d
