// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace mono3d {

// shaders/depth/detail.comp multiplies the detail of an image by so many 1024ths.
inline constexpr std::uint32_t kGainSteps = 1024;

// Variance of the quantiles of the grey values of a CV_8UC1.
double ContrastOf(const cv::Mat& grey);

// By which the contrast of an image is to be multiplied to be that of the reference, another image
// of the same scene with a gain and an offset of its own: the slope of its grey values' quantiles
// to the reference's, from the ContrastOf of both. Which pixel shows what need not be known. 1
// where an image has hardly any contrast; between a quarter and 4.
double ContrastGain(double of_reference, double of_image);

}  // namespace mono3d
