// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/depth_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/evaluation/depth_error.h"

namespace mono3d::tools {
namespace {

constexpr int kDepthMap = cv::COLORMAP_TURBO;
constexpr int kDepthErrorMap = cv::COLORMAP_MAGMA;
constexpr int kConfidenceMap = cv::COLORMAP_VIRIDIS;
const cv::Scalar kNoDepthColour(200, 200, 200);

// Around the panels, px.
constexpr int kPanelGap = 12;
constexpr int kAbove = 30;  // the titles
constexpr int kBelow = 46;  // the legends
constexpr int kBarHeight = 12;

// A few wild values must not take the colours from all others.
constexpr double kLowQuantile = 0.02;
constexpr double kHighQuantile = 0.98;
constexpr double kErrorQuantile = 0.95;

bool IsDepth(float depth) { return depth > 0 && std::isfinite(depth); }

bool IsTrueDepth(float depth, double max_depth) {
  return IsDepth(depth) && (max_depth <= 0 || depth <= max_depth);
}

// What a scale of colours goes from and to.
struct Range {
  double low = 0;
  double high = 1;
  double Share(double value) const { return high > low ? (value - low) / (high - low) : 0.5; }
};

Range InverseDepthRange(const cv::Mat& truth, double max_depth) {
  std::vector<double> inverse;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float z = truth.at<float>(y, x);
      if (IsTrueDepth(z, max_depth)) inverse.push_back(1.0 / z);
    }
  }
  if (inverse.empty()) return {};
  return {Quantile(inverse, kLowQuantile), Quantile(inverse, kHighQuantile)};
}

Range ErrorRange(const cv::Mat& relative_error, double max_relative_error) {
  if (max_relative_error > 0) return {0, max_relative_error};
  std::vector<double> errors;
  for (int y = 0; y < relative_error.rows; ++y) {
    for (int x = 0; x < relative_error.cols; ++x) {
      const float error = relative_error.at<float>(y, x);
      if (!std::isnan(error)) errors.push_back(error);
    }
  }
  const double most = errors.empty() ? 0 : Quantile(errors, kErrorQuantile);
  for (const double end : {0.005, 0.01, 0.02, 0.05, 0.1, 0.2}) {
    if (most <= end) return {0, end};
  }
  return {0, 0.5};
}

// `share_of`: the place on the scale of the pixel at (x, y), NaN: nothing there.
template <typename ShareOf>
cv::Mat Coloured(const cv::Size& size, int colour_map, ShareOf share_of) {
  cv::Mat level(size, CV_8UC1, cv::Scalar(0));
  cv::Mat nothing(size, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double share = share_of(x, y);
      if (std::isnan(share)) {
        nothing.at<std::uint8_t>(y, x) = 1;
      } else {
        level.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(255 * std::clamp(share, 0.0, 1.0));
      }
    }
  }
  cv::Mat colours;
  cv::applyColorMap(level, colours, colour_map);
  colours.setTo(kNoDepthColour, nothing);
  return colours;
}

cv::Mat ColouredDepth(const cv::Mat& depth, double scale, double max_depth, const Range& range) {
  return Coloured(depth.size(), kDepthMap, [&](int x, int y) {
    const float z = depth.at<float>(y, x);
    return IsTrueDepth(z, max_depth) ? range.Share(1 / (scale * z)) : std::nan("");
  });
}

cv::Mat ColouredError(const cv::Mat& relative_error, const Range& range) {
  return Coloured(relative_error.size(), kDepthErrorMap,
                  [&](int x, int y) { return range.Share(relative_error.at<float>(y, x)); });
}

// Where panel i of a picture is, and the bar of a legend below panels `first` to `last`.
cv::Rect PanelRect(int i, const cv::Size& panel) {
  return {kPanelGap + i * (panel.width + kPanelGap), kAbove, panel.width, panel.height};
}
cv::Rect BarRect(int first, int last, const cv::Size& panel) {
  constexpr int kInset = 24;  // for the halves of the texts at the ends
  const cv::Rect begin = PanelRect(first, panel);
  const cv::Rect end = PanelRect(last, panel);
  return {begin.x + kInset, begin.y + begin.height + 10, end.x + end.width - begin.x - 2 * kInset,
          kBarHeight};
}

struct Panel {
  std::string title;
  cv::Mat colours;
};

cv::Mat SideBySide(const std::vector<Panel>& panels, const cv::Size& size) {
  const int count = static_cast<int>(panels.size());
  cv::Mat picture(size.height + kAbove + kBelow, count * (size.width + kPanelGap) + kPanelGap,
                  CV_8UC3, cv::Scalar::all(255));
  for (int i = 0; i < count; ++i) {
    const Panel& panel = panels[static_cast<std::size_t>(i)];
    const cv::Rect rect = PanelRect(i, size);
    const bool shrinks = size.width < panel.colours.cols;
    cv::resize(panel.colours, picture(rect), size, 0, 0,
               shrinks ? cv::INTER_AREA : cv::INTER_NEAREST);
    DrawText(picture, panel.title, cv::Point2d(rect.x, 0.5 * kAbove));
  }
  return picture;
}

cv::Size PanelSize(const cv::Mat& map, const DepthPictureOptions& options) {
  constexpr int kMinWidth = 160;
  if (options.panel_width_px < kMinWidth) {
    throw Error(ErrorParts{.what = "panels of a depth picture are too narrow",
                           .where = {},
                           .expected = std::to_string(kMinWidth) + " px or more",
                           .found = std::to_string(options.panel_width_px)});
  }
  const double height = static_cast<double>(options.panel_width_px) * map.rows / map.cols;
  return {options.panel_width_px, std::max(1, cvRound(height))};
}

std::string Percent(double share) { return ShortText(100 * share) + " %"; }

// Round depths, evenly spread over the bar of inverse depth: those too close to the one before are
// left out.
std::vector<BarTick> DepthTicks(const Range& range, const std::string& unit, int bar_width) {
  if (!(range.high > range.low)) return {{0.5, ShortText(1 / range.low) + " " + unit}};
  std::vector<BarTick> ticks;
  constexpr double kTextGap = 12;  // px
  double last_end = -1e9;
  for (const double depth : Ticks(1 / range.high, 1 / range.low, 16)) {
    if (!(depth > 0)) continue;
    BarTick tick{range.Share(1 / depth), ShortText(depth) + " " + unit};
    // Rising depth goes from the right end to the left.
    const double half = TextWidth(tick.text) / 2;
    const double from_right = (1 - tick.share) * bar_width;
    if (from_right - half < last_end + kTextGap) continue;
    last_end = from_right + half;
    ticks.push_back(std::move(tick));
  }
  return ticks;
}

std::vector<BarTick> PercentTicks(const Range& range) {
  std::vector<BarTick> ticks;
  const std::vector<double> values = Ticks(100 * range.low, 100 * range.high, 5);
  for (const double percent : values) {
    ticks.push_back({range.Share(percent / 100), TickText(percent, values) + " %"});
  }
  return ticks;
}

}  // namespace

cv::Mat DepthPicture(const cv::Mat& estimate, const cv::Mat& truth, double scale,
                     const DepthPictureOptions& options) {
  const DepthError error = CompareDepth(estimate, truth, scale, options.max_depth);
  const cv::Mat relative_error = RelativeDepthErrorImage(estimate, truth, scale, options.max_depth);
  const Range depths = InverseDepthRange(truth, options.max_depth);
  const Range errors = ErrorRange(relative_error, options.max_relative_error);
  const cv::Size size = PanelSize(truth, options);
  cv::Mat picture = SideBySide(
      {{"Estimated depth x " + ShortText(scale) + ", density " + Percent(error.density),
        ColouredDepth(estimate, scale, 0, depths)},
       {"True depth", ColouredDepth(truth, 1, options.max_depth, depths)},
       {"Relative error, mean " + Percent(error.l1_rel), ColouredError(relative_error, errors)}},
      size);
  if (error.num_true_pixels > 0) {
    const cv::Rect bar = BarRect(0, 1, size);
    DrawColourBar(picture, bar, kDepthMap, DepthTicks(depths, options.unit, bar.width));
  }
  DrawColourBar(picture, BarRect(2, 2, size), kDepthErrorMap, PercentTicks(errors));
  return picture;
}

cv::Mat ConfidencePicture(const cv::Mat& confidence, const cv::Mat& estimate, const cv::Mat& truth,
                          double scale, const DepthPictureOptions& options) {
  const cv::Mat relative_error = RelativeDepthErrorImage(estimate, truth, scale, options.max_depth);
  if (confidence.type() != CV_32FC1 || confidence.size() != truth.size()) {
    throw Error("the confidence to draw has another size or type than the true depth");
  }
  const Range errors = ErrorRange(relative_error, options.max_relative_error);
  const cv::Size size = PanelSize(truth, options);
  const cv::Mat shown = Coloured(truth.size(), kConfidenceMap, [&](int x, int y) {
    return IsDepth(estimate.at<float>(y, x)) ? confidence.at<float>(y, x) : std::nan("");
  });
  cv::Mat picture = SideBySide(
      {{"Confidence", shown}, {"Relative error", ColouredError(relative_error, errors)}}, size);
  DrawColourBar(picture, BarRect(0, 0, size), kConfidenceMap,
                {{0, "0"}, {0.25, "0.25"}, {0.5, "0.5"}, {0.75, "0.75"}, {1, "1"}});
  DrawColourBar(picture, BarRect(1, 1, size), kDepthErrorMap, PercentTicks(errors));
  return picture;
}

}  // namespace mono3d::tools
