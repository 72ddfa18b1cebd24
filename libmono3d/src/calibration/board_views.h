// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <opencv2/core/types.hpp>
#include <span>
#include <vector>

#include "calibration/board_detection.h"

namespace mono3d::calibration {

// Views of one board, at most `max_views`, that differ most from each other: by place, size, tilt
// and perspective of the board in the image. Views that are as good as equal to one of them are
// left out. Takes O(views * max_views).
std::vector<std::size_t> ChooseViews(std::span<const BoardView> views, cv::Size image_size,
                                     std::size_t max_views);

}  // namespace mono3d::calibration
