// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d::reference {

// 9x7 census of a CV_8UC1 image, row by row: bit n is set where the n-th neighbour, in rows from
// the top left without the centre, is darker than the centre. Borders are repeated. Of a picture
// that is turned clockwise by quarters each neighbour is where that picture shows it.
std::vector<std::uint64_t> Census(const cv::Mat& grey, unsigned quarter_turns = 0);

// The same of those neighbours alone whose column and row differ from the centre's by an odd number
// in sum.
std::vector<std::uint32_t> HalfCensus(const cv::Mat& grey, unsigned quarter_turns = 0);

}  // namespace mono3d::reference
