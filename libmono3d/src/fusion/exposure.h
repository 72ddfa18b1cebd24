// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace mono3d {

// How an image was exposed: its grey value = gain * the model's + offset.
struct Exposure {
  double gain = 1;
  double offset = 0;
};

// The image is compared with the model cell by cell, as shaders/fusion/exposure_cells.comp sums
// them up: squares, this many to a row at most, none smaller than four windows of the matching.
inline constexpr std::uint32_t kExposureCellsPerRow = 24;
inline constexpr std::uint32_t kMinExposureCell_px = 16;
std::uint32_t ExposureCellSize_px(std::uint32_t width_px);
std::uint32_t NumExposureCells(std::uint32_t width_px, std::uint32_t height_px);
// Number of surfels, sums of the image's and the surfels' grey in 1/4 grey values; 0.
using ExposureCell = std::array<std::uint32_t, 4>;

// Of the blocks of surfels in view, those that are compared: where there are more of them, so many
// that each of `num_cells` cells gets four times the surfels that it needs, on average. Spread
// evenly over the list, and over any rows that it is made of.
std::vector<std::uint32_t> ExposureSample(std::span<const std::uint32_t> blocks,
                                          std::uint32_t num_cells);

// Robust regression of the image's cell means on the model's (iteratively reweighted least
// squares, weights of Geman and McClure, scale from the residuals): what changed between the views,
// as shadows and reflections do, does not count. Where few cells are seen, or all of one
// brightness, the gain of the depth map before this one and no offset hold the result.
Exposure EstimateExposure(std::span<const ExposureCell> cells, const Exposure& before);

// The colours of an image (CV_8UC3) as the model's exposure has them, 0xBBGGRR per pixel. A clipped
// channel stays clipped: how bright the place is, is not known.
std::vector<std::uint32_t> CorrectedColours(const cv::Mat& bgr, const Exposure& exposure);

}  // namespace mono3d
