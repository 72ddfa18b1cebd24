// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d::reference {

// Difference of Gaussians of a CV_8UC1 image in 1/256 grey level, rounded down: binomial kernels of
// 5 and 9 taps each way, borders repeated.
std::vector<std::uint32_t> DogResponse(const cv::Mat& grey);

// Sum of the responses over the census window, 9x7, borders repeated.
std::vector<std::uint32_t> TextureSum(const std::vector<std::uint32_t>& response, int width,
                                      int height);

}  // namespace mono3d::reference
