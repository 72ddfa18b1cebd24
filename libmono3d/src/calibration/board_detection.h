// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <optional>
#include <vector>

#include "mono3d/calibration/board_calibration.h"

namespace mono3d::calibration {

// The corners of the board that one image shows.
struct BoardView {
  std::vector<cv::Point3f> corners;  // in the plane z = 0 of the board, in squares
  std::vector<cv::Point2f> pixels;   // of each
};

class BoardDetector {
 public:
  virtual ~BoardDetector() = default;

  // The whole chessboard, or the part of a ChArUco board that is visible. Nothing where it cannot
  // be found. `grey`: CV_8UC1.
  virtual std::optional<BoardView> Find(const cv::Mat& grey) const = 0;
};

// Throws UsageError unless the board is valid.
std::unique_ptr<BoardDetector> CreateBoardDetector(const CalibrationBoard& board);

}  // namespace mono3d::calibration
