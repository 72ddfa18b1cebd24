// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/cloud_picture.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "drawing/chart.h"
#include "drawing/cloud_renderer.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

constexpr int kTitleHeight_px = 40;
constexpr int kGap_px = 12;
constexpr int kBarHeight_px = 18;
constexpr int kBarBandHeight_px = 92;
constexpr int kNumTicks = 5;
constexpr double kTextSize = 0.6;
const cv::Scalar kInk(40, 40, 40);
// The paper's colours of the estimate and of the truth; blue, green, red.
const cv::Vec3b kYellow = {40, 205, 250};
const cv::Vec3b kBlue = {215, 110, 45};

void Write(cv::Mat& picture, const std::string& text, cv::Point at) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, kTextSize, kInk, 1, cv::LINE_AA);
}

int TextWidth(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kTextSize, 1, &baseline).width;
}

std::string Number(double value, const char* unit) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.3g %s", value, unit);
  return text.data();
}

cv::Mat WithTitle(const cv::Mat& picture, const std::string& title) {
  cv::Mat titled(picture.rows + kTitleHeight_px, picture.cols, CV_8UC3, kChartBackground);
  picture.copyTo(titled.rowRange(kTitleHeight_px, titled.rows));
  Write(titled, title, {8, kTitleHeight_px - 14});
  return titled;
}

// One below the other, on white.
cv::Mat Stack(const std::vector<cv::Mat>& rows) {
  cv::Size size(1, 0);
  for (const cv::Mat& row : rows) {
    size.width = std::max(size.width, row.cols);
    size.height += row.rows;
  }
  cv::Mat stack(size, CV_8UC3, kChartBackground);
  int top = 0;
  for (const cv::Mat& row : rows) {
    row.copyTo(stack(cv::Rect({0, top}, row.size())));
    top += row.rows;
  }
  return stack;
}

// The scale of ErrorColour, with numbers.
cv::Mat ColourBar(int width, double max_distance_m, std::optional<double> mean_depth_m) {
  cv::Mat band(kBarBandHeight_px, width, CV_8UC3, kChartBackground);
  const int left = width / 10;
  const int length = width - 2 * left;
  for (int x = 0; x < length; ++x) {
    const double share = static_cast<double>(x) / std::max(1, length - 1);
    band(cv::Rect(left + x, kGap_px, 1, kBarHeight_px)).setTo(ErrorColour(share));
  }
  cv::rectangle(band, cv::Rect(left, kGap_px, length, kBarHeight_px), kInk, 1);
  for (int tick = 0; tick < kNumTicks; ++tick) {
    const double share = static_cast<double>(tick) / (kNumTicks - 1);
    const int x = left + static_cast<int>(share * (length - 1));
    const int bottom = kGap_px + kBarHeight_px;
    cv::line(band, {x, bottom}, {x, bottom + 5}, kInk);
    const std::string last = tick + 1 == kNumTicks ? "+" : "";  // the end stands for all beyond
    const std::string metres = Number(share * max_distance_m, "m") + last;
    Write(band, metres, {x - TextWidth(metres) / 2, bottom + 24});
    if (!mean_depth_m) continue;
    const std::string percent = Number(100 * share * max_distance_m / *mean_depth_m, "%") + last;
    Write(band, percent, {x - TextWidth(percent) / 2, bottom + 48});
  }
  return band;
}

}  // namespace

cv::Mat CloudsSideBySide(const PointCloud& estimate_in_truth, const PointCloud& truth,
                         std::span<const CloudView> views) {
  const CloudLayer left{.cloud = &estimate_in_truth};
  const CloudLayer right{.cloud = &truth};
  const std::vector<float> left_radii = SplatRadii(estimate_in_truth);
  const std::vector<float> right_radii = SplatRadii(truth);
  std::vector<cv::Mat> rows;
  for (const CloudView& view : views) {
    const cv::Mat pair[] = {
        WithTitle(RenderLayers({&left, 1}, {&left_radii, 1}, view), "Estimate, " + view.name),
        cv::Mat(view.size.height + kTitleHeight_px, kGap_px, CV_8UC3, kChartBackground),
        WithTitle(RenderLayers({&right, 1}, {&right_radii, 1}, view), "Truth, " + view.name)};
    cv::Mat row;
    cv::hconcat(pair, 3, row);
    rows.push_back(row);
  }
  return Stack(rows);
}

cv::Mat CloudsInTwoColours(const PointCloud& estimate_in_truth, const PointCloud& truth,
                           std::span<const CloudView> views) {
  const std::array<CloudLayer, 2> layers = {
      {{.cloud = &estimate_in_truth, .colour = kYellow}, {.cloud = &truth, .colour = kBlue}}};
  const std::array<std::vector<float>, 2> radii = {SplatRadii(estimate_in_truth),
                                                   SplatRadii(truth)};
  std::vector<cv::Mat> rows;
  for (const CloudView& view : views) {
    rows.push_back(
        WithTitle(RenderLayers(layers, radii, view), "Estimate yellow, truth blue, " + view.name));
  }
  return Stack(rows);
}

cv::Mat CloudByDistance(const PointCloud& estimate_in_truth, std::span<const double> distances_m,
                        double max_distance_m, std::span<const CloudView> views,
                        std::optional<double> mean_depth_m) {
  if (distances_m.size() != estimate_in_truth.size()) {
    throw Error(ErrorParts{"a distance for some points only", "CloudByDistance",
                           std::to_string(estimate_in_truth.size()),
                           std::to_string(distances_m.size())});
  }
  const CloudLayer layer{
      .cloud = &estimate_in_truth, .values = distances_m, .max_value = max_distance_m};
  const std::vector<float> radii = SplatRadii(estimate_in_truth);
  std::vector<cv::Mat> rows;
  for (const CloudView& view : views) {
    rows.push_back(WithTitle(RenderLayers({&layer, 1}, {&radii, 1}, view),
                             "Distance of the estimate to the truth, " + view.name));
    if (rows.size() == views.size()) {
      rows.push_back(ColourBar(view.size.width, max_distance_m, mean_depth_m));
    }
  }
  return Stack(rows);
}

}  // namespace mono3d::tools
