// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// All headers at once.

#include <mono3d/mono3d.h>

#include <exception>
#include <iostream>

namespace {

// Links what finds boards: nothing else needs OpenCV's aruco.
bool RefusesABoardWithoutSquares() {
  mono3d::CalibrationBoard board;
  board.columns = 0;
  try {
    mono3d::CalibrateFromBoard({}, {}, board);
  } catch (const mono3d::UsageError&) {
    return true;
  }
  return false;
}

}  // namespace

int main() {
  try {
    if (mono3d::CreateTracker() == nullptr || !RefusesABoardWithoutSquares()) return 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::cout << "mono3d " << mono3d::Version() << '\n';
  return 0;
}
