// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/residual_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/statistics.h"

namespace mono3d::tools {
namespace {

constexpr std::size_t kMinInCell = 5;
const cv::Scalar kNoData(235, 235, 235);
const cv::Scalar kChance(150, 150, 150);
const cv::Scalar kSystematic(40, 40, 200);
const cv::Scalar kAcross(200, 120, 40);

struct MedianError {
  double value = 0;
  double standard_error = 0;
};

MedianError MedianOf(const std::vector<double>& values) {
  constexpr double kMadToSigma = 1.4826;
  constexpr double kErrorOfMedian = 1.2533;  // times sigma / sqrt(n), of normal numbers
  MedianError result{Median(values), 0};
  std::vector<double> deviations;
  for (const double value : values) deviations.push_back(std::abs(value - result.value));
  result.standard_error = kErrorOfMedian * kMadToSigma * Median(deviations) /
                          std::sqrt(static_cast<double>(values.size()));
  return result;
}

// The values of one cell of the image or one ring around its middle.
struct Bin {
  std::vector<double> first;   // to the right, or outwards
  std::vector<double> second;  // down, or across
};

// 1, 2 or 5 times a power of ten, not above `value`.
double RoundDown(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  double result = power;
  for (const double factor : {2., 5.}) {
    if (factor * power <= value) result = factor * power;
  }
  return result;
}

std::vector<Bin> Cells(std::span<const CalibrationResidual> residuals, const CameraModel& camera,
                       cv::Size grid) {
  std::vector<Bin> cells(static_cast<std::size_t>(grid.area()));
  for (const CalibrationResidual& residual : residuals) {
    const double x = (residual.pixel.x() + 0.5) / camera.width;
    const double y = (residual.pixel.y() + 0.5) / camera.height;
    const cv::Point cell(static_cast<int>(std::floor(x * grid.width)),
                         static_cast<int>(std::floor(y * grid.height)));
    if (!cell.inside({{}, grid})) continue;
    Bin& bin = cells[static_cast<std::size_t>(cell.y * grid.width + cell.x)];
    bin.first.push_back(residual.error_px.x());
    bin.second.push_back(residual.error_px.y());
  }
  return cells;
}

struct Arrow {
  cv::Point2d from;  // cells
  cv::Point2d error_px;
  bool is_systematic = false;
};

// Of the cells with enough observations.
std::vector<Arrow> ArrowsOf(const std::vector<Bin>& cells, cv::Size grid) {
  constexpr double kChanceInSigmas = 3;
  std::vector<Arrow> arrows;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].first.size() < kMinInCell) continue;
    const MedianError x = MedianOf(cells[i].first);
    const MedianError y = MedianOf(cells[i].second);
    const int index = static_cast<int>(i);
    arrows.push_back({{index % grid.width + 0.5, index / grid.width + 0.5},
                      {x.value, y.value},
                      std::abs(x.value) > kChanceInSigmas * x.standard_error ||
                          std::abs(y.value) > kChanceInSigmas * y.standard_error});
  }
  return arrows;
}

// How many pixels of the picture one pixel of error is: most arrows stay within their cell.
double Magnification(const std::vector<Arrow>& arrows, double cell_size) {
  constexpr double kMost = 0.9;
  constexpr double kLeast_px = 1e-3;
  std::vector<double> lengths;
  for (const Arrow& arrow : arrows) lengths.push_back(cv::norm(arrow.error_px));
  const double length = lengths.empty() ? 1 : Quantile(lengths, kMost);
  return RoundDown(cell_size / std::max(length, kLeast_px));
}

void DrawArrow(cv::Mat& picture, const cv::Point2d& from, const cv::Point2d& way,
               const cv::Scalar& colour) {
  constexpr int kShift = 4;  // binary digits behind the point
  const auto fixed = [](const cv::Point2d& p) {
    return cv::Point(cvRound(p.x * (1 << kShift)), cvRound(p.y * (1 << kShift)));
  };
  const cv::Point2d to = from + way;
  cv::line(picture, fixed(from), fixed(to), colour, 1, cv::LINE_AA, kShift);
  const double length = cv::norm(way);
  if (length < 2) return;
  const cv::Point2d along = way * (std::min(6., 0.4 * length) / length);
  const cv::Point2d across(-0.5 * along.y, 0.5 * along.x);
  cv::line(picture, fixed(to), fixed(to - along + across), colour, 1, cv::LINE_AA, kShift);
  cv::line(picture, fixed(to), fixed(to - along - across), colour, 1, cv::LINE_AA, kShift);
}

// Of a single observation, per coordinate.
double Spread(std::span<const CalibrationResidual> residuals) {
  std::vector<double> sizes;
  for (const CalibrationResidual& residual : residuals) {
    sizes.push_back(std::abs(residual.error_px.x()));
    sizes.push_back(std::abs(residual.error_px.y()));
  }
  return 1.4826 * UpperMedianOrZero(std::move(sizes));
}

std::string CountText(std::span<const CalibrationResidual> residuals) {
  return std::to_string(residuals.size()) + " observations, each +- " +
         ShortText(Spread(residuals)) + " px";
}

// A plot of errors over distances; y upwards.
struct RadiusPlot {
  cv::Rect area;
  double max_radius_px = 1;
  double max_error_px = 1;

  cv::Point At(double radius_px, double error_px) const {
    return {cvRound(area.x + area.width * radius_px / max_radius_px),
            cvRound(area.y + 0.5 * area.height * (1 - error_px / max_error_px))};
  }
};

std::vector<Bin> Rings(std::span<const CalibrationResidual> residuals, const CameraModel& camera,
                       double ring_px, std::size_t num_rings) {
  std::vector<Bin> rings(num_rings);
  for (const CalibrationResidual& residual : residuals) {
    const Eigen::Vector2d way = residual.pixel - Eigen::Vector2d(camera.cx, camera.cy);
    const double radius = way.norm();
    if (radius == 0) continue;
    const Eigen::Vector2d outwards = way / radius;
    Bin& ring = rings[std::min(static_cast<std::size_t>(radius / ring_px), num_rings - 1)];
    ring.first.push_back(outwards.dot(residual.error_px));
    ring.second.push_back(Eigen::Vector2d(-outwards.y(), outwards.x()).dot(residual.error_px));
  }
  return rings;
}

void DrawRadiusAxes(cv::Mat& picture, const RadiusPlot& plot) {
  const std::vector<double> errors = Ticks(-plot.max_error_px, plot.max_error_px, 8);
  for (const double tick : errors) {
    const cv::Point at = plot.At(0, tick);
    cv::line(picture, at, plot.At(plot.max_radius_px, tick), tick == 0 ? kChartText : kChartGrid);
    DrawText(picture, TickText(tick, errors), cv::Point2d(at) - cv::Point2d(8, 0),
             TextAlign::kRight);
  }
  const std::vector<double> radii = Ticks(0, plot.max_radius_px, 8);
  for (const double tick : radii) {
    const cv::Point at = plot.At(tick, -plot.max_error_px);
    cv::line(picture, at, plot.At(tick, plot.max_error_px), kChartGrid);
    DrawText(picture, TickText(tick, radii), cv::Point2d(at) + cv::Point2d(0, 14),
             TextAlign::kCentre);
  }
  cv::rectangle(picture, plot.area, kChartText);
}

struct RingPoint {
  double radius_px = 0;
  MedianError error;
};

void DrawCurve(cv::Mat& picture, const RadiusPlot& plot, const std::vector<RingPoint>& curve,
               const cv::Scalar& colour) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const auto& [radius, error] = curve[i];
    const double reach = 2 * error.standard_error;
    cv::line(picture, plot.At(radius, error.value - reach), plot.At(radius, error.value + reach),
             colour, 1, cv::LINE_AA);
    cv::circle(picture, plot.At(radius, error.value), 3, colour, cv::FILLED, cv::LINE_AA);
    if (i == 0) continue;
    cv::line(picture, plot.At(curve[i - 1].radius_px, curve[i - 1].error.value),
             plot.At(radius, error.value), colour, 1, cv::LINE_AA);
  }
}

}  // namespace

cv::Mat ResidualFieldPicture(std::span<const CalibrationResidual> residuals,
                             const CameraModel& camera) {
  constexpr int kCellsAlong = 20;  // the larger side
  constexpr int kCell = 44;        // px of the picture
  constexpr int kMargin = 20;
  constexpr int kHeader = 76;
  const double larger = std::max(camera.width, camera.height);
  const cv::Size grid(std::max(1, cvRound(kCellsAlong * camera.width / larger)),
                      std::max(1, cvRound(kCellsAlong * camera.height / larger)));
  const cv::Point corner(kMargin, kHeader);
  cv::Mat picture(kHeader + grid.height * kCell + kMargin, 2 * kMargin + grid.width * kCell,
                  CV_8UC3, kChartBackground);
  const std::vector<Bin> cells = Cells(residuals, camera, grid);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].first.size() >= kMinInCell) continue;
    const int index = static_cast<int>(i);
    const cv::Point cell(index % grid.width, index / grid.width);
    cv::rectangle(picture, cv::Rect(corner + cell * kCell, cv::Size(kCell, kCell)), kNoData,
                  cv::FILLED);
  }
  cv::rectangle(picture, cv::Rect(corner, grid * kCell), kChartText);
  const std::vector<Arrow> arrows = ArrowsOf(cells, grid);
  const double magnification = Magnification(arrows, kCell);
  for (const Arrow& arrow : arrows) {
    DrawArrow(picture, cv::Point2d(corner) + kCell * arrow.from, magnification * arrow.error_px,
              arrow.is_systematic ? kSystematic : kChance);
  }
  DrawText(picture, "Residuals over the image: medians of cells, observed less computed",
           {kMargin, 20}, TextAlign::kLeft, 12);
  DrawText(picture, CountText(residuals) + "; red: beyond chance; grey cell: too few",
           {kMargin, 50});
  const double scale_px = RoundDown(2. * kCell / magnification);
  const double right = picture.cols - kMargin;
  DrawArrow(picture, {right - scale_px * magnification, 50}, {scale_px * magnification, 0},
            kChartText);
  DrawText(picture, ShortText(scale_px) + " px", {right - scale_px * magnification - 8, 50},
           TextAlign::kRight);
  return picture;
}

cv::Mat ResidualByRadiusPicture(std::span<const CalibrationResidual> residuals,
                                const CameraModel& camera) {
  constexpr std::size_t kNumRings = 24;
  RadiusPlot plot{.area = {84, 76, 820, 420}};
  cv::Mat picture(plot.area.y + plot.area.height + 62, plot.area.x + plot.area.width + 30, CV_8UC3,
                  kChartBackground);
  plot.max_radius_px = std::hypot(std::max(camera.cx, camera.width - 1 - camera.cx),
                                  std::max(camera.cy, camera.height - 1 - camera.cy));
  const double ring_px = plot.max_radius_px / kNumRings;
  const std::vector<Bin> rings = Rings(residuals, camera, ring_px, kNumRings);
  std::vector<RingPoint> outwards;
  std::vector<RingPoint> across;
  constexpr double kLeastRange_px = 0.01;
  plot.max_error_px = kLeastRange_px;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (rings[i].first.size() < kMinInCell) continue;
    const double radius_px = (static_cast<double>(i) + 0.5) * ring_px;
    outwards.push_back({radius_px, MedianOf(rings[i].first)});
    across.push_back({radius_px, MedianOf(rings[i].second)});
    for (const MedianError& error : {outwards.back().error, across.back().error}) {
      plot.max_error_px =
          std::max(plot.max_error_px, 1.1 * (std::abs(error.value) + 2 * error.standard_error));
    }
  }
  DrawRadiusAxes(picture, plot);
  DrawCurve(picture, plot, across, kAcross);
  DrawCurve(picture, plot, outwards, kSystematic);
  DrawText(picture, "Residuals by distance from the principal point: medians, +- 2 standard errors",
           {20, 20}, TextAlign::kLeft, 12);
  DrawText(picture, CountText(residuals), {20, 50});
  const double right = plot.area.x + plot.area.width;
  DrawText(picture, "outwards (px)", {right - 130, 50}, TextAlign::kRight, 10, kSystematic);
  DrawText(picture, "across (px)", {right, 50}, TextAlign::kRight, 10, kAcross);
  DrawText(picture, "distance (px)", {plot.area.x + 0.5 * plot.area.width, picture.rows - 16.},
           TextAlign::kCentre);
  return picture;
}

}  // namespace mono3d::tools
