// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_prior.h"

namespace MONO3D_EXPORT mono3d {

enum class BoardKind { kChessboard, kCharuco };

// A flat board of squares. Their size does not matter to a camera.
struct CalibrationBoard {
  BoardKind kind = BoardKind::kChessboard;
  // Of a chessboard the inner corners along each side, of a ChArUco board the squares.
  int columns = 9;
  int rows = 6;
  // Of a ChArUco board: OpenCV's name of the dictionary, and the side of a marker as a share of
  // that of a square. The pattern is that of OpenCV 4.6 and later, whose corner squares differ from
  // earlier ones where the number of rows is even.
  std::string dictionary = "DICT_5X5_100";
  double marker_share = 0.75;

  void Validate() const;  // throws UsageError
};

// Learns the camera of footage of a calibration board that is shown from many sides. Of the images
// with the board up to 40 are used that differ most in its place, size and tilt. What `prior` says
// has no weight beside a board but for the parameters that the images do not determine, which stay
// as it has them. Footage without enough of the board is a reason, not an error; errors of the
// footage are thrown. At most 300 images are searched, about 0.1 s each for 1920x1080.
CameraCalibration CalibrateFromBoard(const CameraPrior& prior, const FootageOpener& open,
                                     const CalibrationBoard& board);

}  // namespace mono3d
