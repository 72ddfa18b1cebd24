// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace mono3d::tools {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapitalHeight = 21;  // of the font at scale 1, px
constexpr int kOversampling = 4;       // the strokes of the font are whole pixels wide
constexpr double kStrokeByHeight = 0.13;

struct LargeText {
  double scale = 1;
  int stroke = 1;
  cv::Size size;
  int below = 0;  // of the base line
};

LargeText Measure(const std::string& text, double height_px) {
  LargeText large;
  large.scale = kOversampling * height_px / kCapitalHeight;
  large.stroke = std::max(1, cvRound(kOversampling * kStrokeByHeight * height_px));
  large.size = cv::getTextSize(text, kFont, large.scale, large.stroke, &large.below);
  return large;
}

std::string Format(const char* format, int digits, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, digits, value);
  return text.data();
}

}  // namespace

double TextWidth(const std::string& text, double height_px) {
  return static_cast<double>(Measure(text, height_px).size.width) / kOversampling;
}

void DrawText(cv::Mat& image, const std::string& text, const cv::Point2d& position, TextAlign align,
              double height_px, const cv::Scalar& colour) {
  if (text.empty()) return;
  const LargeText large = Measure(text, height_px);
  const double width = static_cast<double>(large.size.width) / kOversampling;
  const double share = align == TextAlign::kLeft ? 0 : align == TextAlign::kCentre ? 0.5 : 1;
  const int margin = static_cast<int>(std::ceil(height_px));
  const cv::Point corner(cvRound(position.x - share * width) - margin,
                         cvRound(position.y - height_px / 2) - margin);
  const cv::Size small(static_cast<int>(std::ceil(width)) + 2 * margin,
                       static_cast<int>(std::ceil(height_px)) + 2 * margin);
  cv::Mat drawn(small * kOversampling, CV_8UC1, cv::Scalar(0));
  const cv::Point base(kOversampling * margin,
                       kOversampling * margin + cvRound(kOversampling * height_px));
  cv::putText(drawn, text, base, kFont, large.scale, cv::Scalar(255), large.stroke, cv::LINE_AA);
  cv::Mat cover;
  cv::resize(drawn, cover, small, 0, 0, cv::INTER_AREA);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      const cv::Point at = corner + cv::Point(x, y);
      if (!at.inside({0, 0, image.cols, image.rows})) continue;
      const double part = cover.at<std::uint8_t>(y, x) / 255.0;
      auto& pixel = image.at<cv::Vec3b>(at);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<std::uint8_t>((1 - part) * pixel[c] + part * colour[c]);
      }
    }
  }
}

std::vector<double> Ticks(double low, double high, int max_count) {
  if (!(high > low)) return {low};
  const double least = (high - low) / std::max(max_count, 1);
  const double power = std::pow(10, std::floor(std::log10(least)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= least) step = factor * power;
  }
  std::vector<double> ticks;
  constexpr double kRounding = 1e-9;
  for (double i = std::ceil(low / step - kRounding); i * step <= high + kRounding * step; ++i) {
    ticks.push_back(i == 0 ? 0 : i * step);
  }
  return ticks;
}

std::string TickText(double tick, const std::vector<double>& ticks) {
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : std::abs(tick);
  constexpr double kMinPlain = 1e-4;
  constexpr double kMaxPlain = 1e6;
  if (tick != 0 && (step < kMinPlain || std::abs(tick) > kMaxPlain)) {
    return Format("%.*g", 4, tick);
  }
  const int digits = step > 0 ? static_cast<int>(-std::floor(std::log10(step) + 1e-9)) : 0;
  return Format("%.*f", std::max(digits, 0), tick);
}

std::string ShortText(double value) {
  const double size = std::abs(value);
  if (size >= 100 && size < 1e6) return Format("%.*f", 0, value);
  return Format("%.*g", 3, value);
}

cv::Vec3b MapColour(int colour_map, double share) {
  const cv::Mat level(1, 1, CV_8UC1, cv::Scalar(255 * std::clamp(share, 0.0, 1.0)));
  cv::Mat colour;
  cv::applyColorMap(level, colour, colour_map);
  return colour.at<cv::Vec3b>(0, 0);
}

void DrawColourBar(cv::Mat& image, const cv::Rect& bar, int colour_map,
                   const std::vector<BarTick>& ticks) {
  const bool lies = bar.width > bar.height;
  const int length = lies ? bar.width : bar.height;
  cv::Mat levels(lies ? 1 : length, lies ? length : 1, CV_8UC1);
  for (int i = 0; i < length; ++i) {
    const double share = static_cast<double>(i) / std::max(length - 1, 1);
    levels.data[lies ? i : length - 1 - i] = cv::saturate_cast<std::uint8_t>(255 * share);
  }
  cv::Mat colours;
  cv::applyColorMap(levels, colours, colour_map);
  cv::resize(colours, image(bar), bar.size(), 0, 0, cv::INTER_NEAREST);
  cv::rectangle(image, bar, kChartText, 1);
  constexpr int kMark = 4;
  for (const BarTick& tick : ticks) {
    const int along = cvRound(tick.share * (length - 1));
    const cv::Point at = lies ? cv::Point(bar.x + along, bar.y + bar.height)
                              : cv::Point(bar.x + bar.width, bar.y + length - 1 - along);
    const cv::Point end = at + (lies ? cv::Point(0, kMark) : cv::Point(kMark, 0));
    cv::line(image, at, end, kChartText, 1);
    if (lies) {
      DrawText(image, tick.text, cv::Point2d(end) + cv::Point2d(0, 9), TextAlign::kCentre);
    } else {
      DrawText(image, tick.text, cv::Point2d(end) + cv::Point2d(4, 0), TextAlign::kLeft);
    }
  }
}

}  // namespace mono3d::tools
