// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

namespace mono3d::tools {

// What the pictures of errors share: text, ticks, colour bars. Images are CV_8UC3 (BGR).

inline const cv::Scalar kChartBackground(255, 255, 255);
inline const cv::Scalar kChartText(40, 40, 40);
inline const cv::Scalar kChartGrid(225, 225, 225);

enum class TextAlign { kLeft, kCentre, kRight };

// Text whose capitals are `height_px` high, its middle at the height of `position`.
void DrawText(cv::Mat& image, const std::string& text, const cv::Point2d& position,
              TextAlign align = TextAlign::kLeft, double height_px = 10,
              const cv::Scalar& colour = kChartText);
double TextWidth(const std::string& text, double height_px = 10);

// Multiples of a step of 1, 2 or 5 times a power of ten from low to high, at most max_count of
// them.
std::vector<double> Ticks(double low, double high, int max_count);
// A tick as text, with as many digits as tell it from its neighbours.
std::string TickText(double tick, const std::vector<double>& ticks);
// Three significant digits.
std::string ShortText(double value);

// A colour map of OpenCV (cv::COLORMAP_...) at a share of 0 to 1; beyond is clamped.
cv::Vec3b MapColour(int colour_map, double share);

// A tick of a colour bar: where, from 0 to 1, and what is written there.
struct BarTick {
  double share = 0;
  std::string text;
};
// A bar with the ticks below it, when it is wider than high, else to its right, rising upwards.
void DrawColourBar(cv::Mat& image, const cv::Rect& bar, int colour_map,
                   const std::vector<BarTick>& ticks);

}  // namespace mono3d::tools
