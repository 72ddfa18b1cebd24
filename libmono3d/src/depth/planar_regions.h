// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

namespace mono3d {

struct PlanarRegionsInput {
  cv::Mat bgr;         // CV_8UC3
  cv::Mat depth;       // CV_32FC1, su; 0: not matched
  cv::Mat unfiltered;  // CV_32FC1, inverse depth before the texture filter, 1/su
  // CV_32FC1, inverse depth of the best plane of the sweep on a level of the pyramid, 1/su:
  // negative where it is not clear, 0 where there is none. Empty: not known.
  cv::Mat winners;
  int winner_level = 0;    // its halvings
  cv::Mat sky;             // FindSky
  double step = 0;         // between planes of the sweep, 1/su
  int max_difference = 0;  // of a winner from a plane that it agrees with, in planes of the sweep
};

// What is known of cells (image_cells.h) before depth is inferred in them, CV_32FC4: inverse depth
// of a plane in the middle of the cell (1/su), its slopes along x and y (1/su per px), and the
// confidence in it; that is 0 where no plane is known, and below 0 in the sky. Above 1 it is 1 more
// than the confidence: the plane is believed in all of its region, whatever pixels there say.
//
// Planes are fitted to regions without depth of one colour, such as a roof, a wall or a door: where
// most of what was matched around a region and in it lies on one plane, so does the region. The
// confidence falls with the standard deviation of the plane there, in planes of the sweep.
//
// The best planes of the sweep in a bare region are noise, pixel by pixel, but not over all of it:
// if they are on the plane more often than elsewhere, and than by chance, it is believed as a
// whole. Such a plane may also be that of fewer samples around, as long as nearly all others stand
// before it: a wall is known by what hangs on it, though a sofa stands before it.
//
// A region in which most of what the texture filter took away lies on a smooth surface needs no
// plane: that says more of its shape.
cv::Mat FindPlanarRegions(const PlanarRegionsInput& input);

}  // namespace mono3d
