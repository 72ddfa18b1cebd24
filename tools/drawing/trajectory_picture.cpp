// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/trajectory_picture.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d::tools {
namespace {

constexpr int kPositionErrorMap = cv::COLORMAP_TURBO;
const cv::Scalar kTruth(130, 130, 130);
const cv::Scalar kFrame(120, 120, 120);

// Around the plot, px.
constexpr int kLeft = 84;
constexpr int kRight = 120;
constexpr int kTop = 64;
constexpr int kBottom = 62;

// The plane to look at, with its origin at the first true position.
struct TopView {
  Eigen::Vector3d origin;
  Eigen::Vector3d right;
  Eigen::Vector3d ahead;  // up in the picture

  Eigen::Vector2d operator()(const Eigen::Vector3d& p_truth) const {
    return {right.dot(p_truth - origin), ahead.dot(p_truth - origin)};
  }
};

// Between up and back of the cameras: the upper side for any that does not look up, be its view
// level, oblique or straight down.
Eigen::Vector3d UpperSide(std::span<const StampedPose> poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : poses) {
    sum += pose.T_world_cam.rotation() * Eigen::Vector3d(0, -1, -1);
  }
  return sum;
}

TopView ViewFromAbove(std::span<const StampedPose> truth) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : truth) mean += pose.T_world_cam.translation();
  mean /= static_cast<double>(truth.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const StampedPose& pose : truth) {
    const Eigen::Vector3d offset = pose.T_world_cam.translation() - mean;
    spread += offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);  // rising eigenvalues
  const Eigen::Vector3d upper = UpperSide(truth);
  Eigen::Vector3d normal = solver.eigenvectors().col(0);
  constexpr double kLine = 0.05;  // extent across by extent along: no plane to speak of
  if (solver.eigenvalues()(1) <= kLine * kLine * solver.eigenvalues()(2)) {
    const Eigen::Vector3d direction = solver.eigenvectors().col(2);
    const Eigen::Vector3d across = upper - direction * direction.dot(upper);
    if (across.norm() > kLine * upper.norm()) normal = across.normalized();
  }
  if (normal.dot(upper) < 0) normal = -normal;
  // Right is the world's x, unless that stands on the plane.
  const bool x_stands = std::abs(normal.x()) > 0.9;
  const Eigen::Vector3d axis = x_stands ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d right = (axis - normal * normal.dot(axis)).normalized();
  return {truth.front().T_world_cam.translation(), right, normal.cross(right)};
}

// The part of the picture with the paths, and its scale.
struct Plot {
  cv::Rect rect;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // in the plane
  double unit_px = 1;                                // of a unit of the truth

  cv::Point2d operator()(const Eigen::Vector2d& p) const {
    return {rect.x + rect.width / 2.0 + unit_px * (p - centre).x(),
            rect.y + rect.height / 2.0 - unit_px * (p - centre).y()};
  }
  Eigen::Vector2d HalfExtent() const {
    return Eigen::Vector2d(rect.width, rect.height) / (2 * unit_px);
  }
};

Plot FitPlot(const std::vector<Eigen::Vector2d>& points, const cv::Size& size) {
  Eigen::Vector2d low = points.front();
  Eigen::Vector2d high = points.front();
  for (const Eigen::Vector2d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Plot plot;
  plot.rect = {kLeft, kTop, size.width - kLeft - kRight, size.height - kTop - kBottom};
  plot.centre = (low + high) / 2;
  constexpr double kPlotMargin = 1.12;
  const Eigen::Vector2d extent = kPlotMargin * (high - low);
  const double by_width = extent.x() > 0 ? plot.rect.width / extent.x() : 0;
  const double by_height = extent.y() > 0 ? plot.rect.height / extent.y() : 0;
  plot.unit_px =
      by_width > 0 && by_height > 0 ? std::min(by_width, by_height) : std::max(by_width, by_height);
  if (!(plot.unit_px > 0)) plot.unit_px = 100;  // all in one place: any scale will do
  return plot;
}

void DrawLine(cv::Mat& picture, const cv::Point2d& from, const cv::Point2d& to,
              const cv::Scalar& colour, int thickness) {
  constexpr int kFractionBits = 4;
  constexpr double kOne = 1 << kFractionBits;
  cv::line(picture, cv::Point(cvRound(from.x * kOne), cvRound(from.y * kOne)),
           cv::Point(cvRound(to.x * kOne), cvRound(to.y * kOne)), colour, thickness, cv::LINE_AA,
           kFractionBits);
}

void DrawAxes(cv::Mat& picture, const Plot& plot, const std::string& unit) {
  constexpr int kTickDistance = 80;  // px, at least
  const Eigen::Vector2d low = plot.centre - plot.HalfExtent();
  const Eigen::Vector2d high = plot.centre + plot.HalfExtent();
  const double bottom = plot.rect.y + plot.rect.height;
  const auto x_ticks = Ticks(low.x(), high.x(), plot.rect.width / kTickDistance);
  for (const double tick : x_ticks) {
    const double x = plot({tick, 0}).x;
    DrawLine(picture, {x, static_cast<double>(plot.rect.y)}, {x, bottom}, kChartGrid, 1);
    DrawText(picture, TickText(tick, x_ticks), {x, bottom + 14}, TextAlign::kCentre);
  }
  const auto y_ticks = Ticks(low.y(), high.y(), plot.rect.height / kTickDistance);
  for (const double tick : y_ticks) {
    const double y = plot({0, tick}).y;
    DrawLine(picture, {static_cast<double>(plot.rect.x), y},
             {static_cast<double>(plot.rect.x + plot.rect.width), y}, kChartGrid, 1);
    DrawText(picture, TickText(tick, y_ticks), {plot.rect.x - 8.0, y}, TextAlign::kRight);
  }
  cv::rectangle(picture, plot.rect, kFrame, 1);
  DrawText(picture, "seen from above, " + unit + " from the start",
           {plot.rect.x + plot.rect.width / 2.0, bottom + 38}, TextAlign::kCentre);
}

void DrawDashed(cv::Mat& picture, const std::vector<cv::Point2d>& path) {
  constexpr double kDash = 9;  // px
  constexpr double kPeriod = 15;
  double travelled = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const cv::Point2d step = path[i] - path[i - 1];
    const double length = std::hypot(step.x, step.y);
    double at = 0;
    while (at < length) {
      const double phase = std::fmod(travelled + at, kPeriod);
      const bool is_dash = phase < kDash;
      // The least step keeps rounding from standing still.
      const double end = std::min(length, at + std::max((is_dash ? kDash : kPeriod) - phase, 0.01));
      if (is_dash) {
        DrawLine(picture, path[i - 1] + step * (at / length), path[i - 1] + step * (end / length),
                 kTruth, 2);
      }
      at = end;
    }
    travelled += length;
  }
}

cv::Scalar ErrorColour(double error, double max_error) {
  return cv::Scalar(MapColour(kPositionErrorMap, error / max_error));
}

void DrawEstimate(cv::Mat& picture, const Plot& plot, const TopView& view,
                  const std::vector<AssociatedPose>& poses, double max_error) {
  // Poses far apart in the list, by the measure of the others, have a gap between them: no line.
  std::vector<double> steps = {1};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    steps.push_back(static_cast<double>(poses[i].truth_index) -
                    static_cast<double>(poses[i - 1].truth_index));
  }
  constexpr double kMaxGap = 5;
  const double most = kMaxGap * Median(steps);
  constexpr std::size_t kFew = 100;  // so few are marked one by one
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const cv::Point2d at = plot(view(poses[i].T_truth_cam_estimated.translation()));
    if (i > 0 && std::abs(steps[i]) <= most) {
      const double error = (poses[i].position_error + poses[i - 1].position_error) / 2;
      DrawLine(picture, plot(view(poses[i - 1].T_truth_cam_estimated.translation())), at,
               ErrorColour(error, max_error), 6);
    }
    if (poses.size() <= kFew) {
      DrawLine(picture, at, at, ErrorColour(poses[i].position_error, max_error), 10);
    }
  }
}

void DrawStart(cv::Mat& picture, const cv::Point2d& at) {
  cv::circle(picture, at, 7, cv::Scalar::all(255), cv::FILLED, cv::LINE_AA);
  cv::circle(picture, at, 7, kChartText, 2, cv::LINE_AA);
}

void DrawLegend(cv::Mat& picture, const TrajectoryError& error,
                const TrajectoryPictureOptions& options, double max_error) {
  constexpr double kTitleHeight = 13;
  const std::string title = options.title.empty() ? "Trajectory" : options.title;
  DrawText(picture, title, {kLeft, 18}, TextAlign::kLeft, kTitleHeight);
  const std::string figures = "RMSE " + ShortText(error.position.rmse) + " " + options.unit +
                              ", max " + ShortText(error.position.max) + " " + options.unit + ", " +
                              std::to_string(error.poses.size()) + " of " +
                              std::to_string(error.num_true) + " true poses";
  DrawText(picture, figures, {kLeft, 44});
  // From the right: estimate, truth, start.
  double x = picture.cols - kRight;
  for (const std::string name : {"estimate", "truth", "start"}) {
    x -= TextWidth(name);
    DrawText(picture, name, {x, 18});
    x -= 40;
    if (name == "truth") DrawDashed(picture, {{x, 18}, {x + 32, 18}});
    if (name == "start") DrawStart(picture, {x + 22, 18});
    for (int i = 0; name == "estimate" && i < 32; ++i) {
      DrawLine(picture, {x + i, 18}, {x + i + 1, 18}, ErrorColour(i, 31), 6);
    }
    x -= 18;
  }
  const cv::Rect bar(picture.cols - kRight + 24, kTop + 22, 16, picture.rows - kTop - kBottom - 22);
  std::vector<BarTick> ticks;
  const std::vector<double> values = Ticks(0, max_error, 6);
  for (const double value : values) ticks.push_back({value / max_error, TickText(value, values)});
  DrawColourBar(picture, bar, kPositionErrorMap, ticks);
  DrawText(picture, "error, " + options.unit, {bar.x - 4.0, kTop + 4.0});
}

}  // namespace

cv::Mat TrajectoryPicture(const TrajectoryError& error, std::span<const StampedPose> truth,
                          const TrajectoryPictureOptions& options) {
  if (options.width_px < 320 || options.height_px < 240 || truth.empty()) {
    throw Error(ErrorParts{.what = "cannot draw the trajectory",
                           .where = {},
                           .expected = "320x240 px or more, one true pose or more",
                           .found = std::to_string(options.width_px) + "x" +
                                    std::to_string(options.height_px) + " px, " +
                                    std::to_string(truth.size()) + " true poses"});
  }
  const TopView view = ViewFromAbove(truth);
  std::vector<Eigen::Vector2d> points;
  for (const StampedPose& pose : truth) points.push_back(view(pose.T_world_cam.translation()));
  const std::size_t num_true = points.size();
  for (const AssociatedPose& pose : error.poses) {
    points.push_back(view(pose.T_truth_cam_estimated.translation()));
  }
  cv::Mat picture(options.height_px, options.width_px, CV_8UC3, cv::Scalar::all(255));
  const Plot plot = FitPlot(points, picture.size());
  DrawAxes(picture, plot, options.unit);
  std::vector<cv::Point2d> true_path;
  for (std::size_t i = 0; i < num_true; ++i) true_path.push_back(plot(points[i]));
  const double max_error = error.position.max > 0 ? error.position.max : 1;
  DrawEstimate(picture, plot, view, error.poses, max_error);
  DrawDashed(picture, true_path);
  DrawStart(picture, true_path.front());
  DrawLegend(picture, error, options, max_error);
  return picture;
}

}  // namespace mono3d::tools
