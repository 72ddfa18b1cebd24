// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/model_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/statistics.h"
#include "mono3d/pipeline/world_axes.h"

namespace mono3d::tools {
namespace {

constexpr std::size_t kMaxDrawn = 120'000;
constexpr std::size_t kMaxForViews = 10'000;
constexpr int kOverviewWidth_px = 960;
constexpr int kSmallWidth_px = kOverviewWidth_px / 2;
constexpr int kCoverageWidth_px = 640;
constexpr int kMaxSquare_px = 10;
constexpr double kSquareSide = 1.6;  // radii: of a square of nearly the disc's area
// The path may make a picture so many times as wide as the model alone: far away, the model would
// be a spot.
constexpr double kMaxGrowth = 2.5;
constexpr int kMaxCoverage = 10;  // depth maps, at the end of the colour scale
const cv::Scalar kStart(60, 150, 30);
const cv::Scalar kPathHalo(255, 255, 255);
const cv::Scalar kNextView(160, 30, 150);

template <typename Value>
std::vector<Value> EveryStep(const std::vector<Value>& values, std::size_t step) {
  std::vector<Value> some;
  some.reserve(values.size() / step + 1);
  for (std::size_t i = 0; i < values.size(); i += step) some.push_back(values[i]);
  return some;
}

Eigen::Vector3d InView(const CloudView& view, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d at = view.R_view_world * (p_world - view.centre_world) / view.pixel_su;
  return {at.x() + 0.5 * view.size.width, at.y() + 0.5 * view.size.height, at.z()};
}

cv::Vec3b ColourOfPoint(const PointCloud& cloud, std::size_t i) {
  if (cloud.colours.empty()) return {150, 150, 150};
  const auto& [red, green, blue] = cloud.colours[i];
  return {blue, green, red};
}

template <typename ColourOf>
cv::Mat DrawPoints(const PointCloud& cloud, const CloudView& view, const ColourOf& colour_of) {
  cv::Mat picture(view.size, CV_8UC3, cv::Scalar(255, 255, 255));
  cv::Mat nearest(view.size, CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d at = InView(view, cloud.points[i].cast<double>());
    const double radius_px = cloud.radii.empty() ? 1 : cloud.radii[i] / view.pixel_su;
    const int side =
        std::clamp(static_cast<int>(std::lround(kSquareSide * radius_px)), 1, kMaxSquare_px);
    if (!(std::abs(at.x()) < 1e6) || !(std::abs(at.y()) < 1e6)) continue;
    const int left = static_cast<int>(std::lround(at.x() - 0.5 * side));
    const int top = static_cast<int>(std::lround(at.y() - 0.5 * side));
    const cv::Vec3b colour = colour_of(i);
    const auto depth = static_cast<float>(at.z());
    for (int y = std::max(0, top); y < std::min(top + side, picture.rows); ++y) {
      for (int x = std::max(0, left); x < std::min(left + side, picture.cols); ++x) {
        float& before = nearest.at<float>(y, x);
        if (depth >= before) continue;
        before = depth;
        picture.at<cv::Vec3b>(y, x) = colour;
      }
    }
  }
  return picture;
}

// Turbo without its dark ends.
std::array<cv::Scalar, 32> ColoursOfTime() {
  std::array<cv::Scalar, 32> colours;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const cv::Vec3b colour = MapColour(
        cv::COLORMAP_TURBO, 0.15 + 0.75 * static_cast<double>(i) / (colours.size() - 1.0));
    colours.at(i) = cv::Scalar(colour[0], colour[1], colour[2]);
  }
  return colours;
}

std::vector<cv::Point> InPicture(const std::vector<TrajectoryEntry>& entries,
                                 const CloudView& view) {
  std::vector<cv::Point> points;
  for (const TrajectoryEntry& entry : entries) {
    const Eigen::Vector3d at = InView(view, entry.T_world_cam.translation());
    points.emplace_back(static_cast<int>(std::lround(std::clamp(at.x(), -1e4, 1e4))),
                        static_cast<int>(std::lround(std::clamp(at.y(), -1e4, 1e4))));
  }
  return points;
}

// The most frequent distance of two frames: 1, or the stride.
std::int64_t StepOf(const std::vector<TrajectoryEntry>& entries) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    steps.push_back(static_cast<double>(entries[i].frame_index - entries[i - 1].frame_index));
  }
  return steps.empty() ? 1 : std::max<std::int64_t>(1, std::lround(Quantile(steps, 0.5)));
}

// Photographs in any order have no path between them.
void DrawPath(const MapReconstruction& map, const CloudView& view, bool is_path, cv::Mat& picture) {
  const std::vector<cv::Point> path = InPicture(map.trajectory, view);
  if (path.empty()) return;
  const std::int64_t step = StepOf(map.trajectory);
  const std::array<cv::Scalar, 32> colours = ColoursOfTime();
  for (const bool is_halo : {true, false}) {
    for (std::size_t i = 1; is_path && i < path.size(); ++i) {
      const bool is_gap =
          map.trajectory[i].frame_index - map.trajectory[i - 1].frame_index > 3 * step;
      if (is_gap) continue;
      const cv::Scalar& colour = colours.at(i * colours.size() / path.size());
      cv::line(picture, path[i - 1], path[i], is_halo ? kPathHalo : colour, is_halo ? 4 : 2,
               cv::LINE_AA);
    }
  }
  for (const cv::Point& at : InPicture(map.keyframes, view)) {
    cv::circle(picture, at, 3, kPathHalo, cv::FILLED, cv::LINE_AA);
    cv::circle(picture, at, 2, kChartText, cv::FILLED, cv::LINE_AA);
  }
  if (!is_path) return;
  cv::circle(picture, path.front(), 6, kPathHalo, 4, cv::LINE_AA);
  cv::circle(picture, path.front(), 6, kStart, 2, cv::LINE_AA);
  DrawText(picture, "start", {path.front().x + 10.0, path.front().y + 0.0}, TextAlign::kLeft, 9,
           kStart);
}

std::vector<Eigen::Vector3d> PlacesOf(const std::vector<TrajectoryEntry>& entries) {
  std::vector<Eigen::Vector3d> places;
  for (const TrajectoryEntry& entry : entries) places.push_back(entry.T_world_cam.translation());
  return places;
}

// The view, enlarged until it shows the places.
CloudView WithPlaces(CloudView view, const std::vector<Eigen::Vector3d>& places, int width_px) {
  Eigen::Array2d low(0, 0);
  Eigen::Array2d high(view.size.width, view.size.height);
  const Eigen::Array2d size = high;
  for (const Eigen::Vector3d& place : places) {
    const Eigen::Array2d at = InView(view, place).head<2>().array();
    low = low.min(at - 0.03 * size.maxCoeff());
    high = high.max(at + 0.03 * size.maxCoeff());
  }
  const double room = (kMaxGrowth - 1) * size.maxCoeff();
  low = low.max(-room);
  high = high.min(size + room);
  const Eigen::Array2d middle = 0.5 * (low + high) - 0.5 * size;
  view.centre_world +=
      view.R_view_world.transpose() * (Eigen::Vector3d(middle.x(), middle.y(), 0) * view.pixel_su);
  const Eigen::Array2d extent = high - low;
  view.pixel_su *= extent.maxCoeff() / width_px;
  const int height = static_cast<int>(std::ceil(extent.y() / extent.maxCoeff() * width_px));
  view.size = {width_px, std::clamp(height, width_px / 4, width_px)};
  return view;
}

// A bar of a round length, and where north is: of a model on the earth, whose unit is the metre.
void DrawScale(const MapReconstruction& map, const CloudView& view, cv::Mat& picture) {
  if (!map.georeference) return;
  const double longest_m = 0.25 * view.size.width * view.pixel_su;
  const double power = std::pow(10, std::floor(std::log10(longest_m)));
  const double length_m = power * (longest_m >= 5 * power ? 5 : longest_m >= 2 * power ? 2 : 1);
  const auto length_px = static_cast<int>(std::lround(length_m / view.pixel_su));
  constexpr int kMargin = 12, kHeight = 34, kArrow = 26;
  const cv::Point left(kMargin, view.size.height - kMargin);
  const cv::Point right(left.x + length_px, left.y);
  // What lies below stays to be seen.
  cv::Mat ground = picture(cv::Rect(0, view.size.height - kMargin - kHeight,
                                    right.x + 2 * kMargin + kArrow, kMargin + kHeight) &
                           cv::Rect({0, 0}, picture.size()));
  ground = 0.3 * ground + cv::Scalar(178, 178, 178);
  for (const cv::Point& end : {left, right}) {
    cv::line(picture, end, end - cv::Point(0, 6), kChartText, 2);
  }
  cv::line(picture, left, right, kChartText, 2);
  DrawText(picture, ShortText(length_m) + " m", {0.5 * (left.x + right.x), left.y - 14.0},
           TextAlign::kCentre, 10, kChartText);
  const Eigen::Vector2d north = (view.R_view_world * Eigen::Vector3d::UnitY()).head<2>();
  if (!(north.norm() > 0.5)) return;  // seen from the side
  const Eigen::Vector2d half = 0.5 * kArrow * north.normalized();
  const Eigen::Vector2d middle(right.x + kMargin + 0.5 * kArrow, left.y - 0.5 * kArrow);
  const auto at = [&](double share) {
    const Eigen::Vector2d place = middle + share * half;
    return cv::Point(static_cast<int>(std::lround(place.x())),
                     static_cast<int>(std::lround(place.y())));
  };
  cv::arrowedLine(picture, at(-1), at(0.4), kChartText, 2, cv::LINE_AA, 0, 0.45);
  const Eigen::Vector2d letter = middle + half;
  DrawText(picture, "N", {letter.x(), letter.y()}, TextAlign::kCentre, 9, kChartText);
}

cv::Mat WithName(cv::Mat picture, const std::string& name) {
  DrawText(picture, name, {10, 14}, TextAlign::kLeft, 9, kChartText);
  return picture;
}

cv::Mat PictureOfWords(const std::string& words) {
  cv::Mat picture(240, kOverviewWidth_px, CV_8UC3, cv::Scalar(255, 255, 255));
  DrawText(picture, words, {0.5 * kOverviewWidth_px, 120}, TextAlign::kCentre, 14);
  return picture;
}

cv::Mat Padded(const cv::Mat& picture, cv::Size size) {
  cv::Mat padded(size, CV_8UC3, cv::Scalar(255, 255, 255));
  picture.copyTo(padded(cv::Rect({0, 0}, picture.size())));
  return padded;
}

}  // namespace

PointCloud SampleOf(const PointCloud& cloud, std::size_t max_size) {
  const std::size_t step = std::max<std::size_t>(1, (cloud.size() + max_size - 1) / max_size);
  PointCloud sample;
  sample.points = EveryStep(cloud.points, step);
  sample.normals = EveryStep(cloud.normals, step);
  sample.colours = EveryStep(cloud.colours, step);
  sample.radii = EveryStep(cloud.radii, step);
  sample.confidences = EveryStep(cloud.confidences, step);
  sample.observations = EveryStep(cloud.observations, step);
  sample.inferred = EveryStep(cloud.inferred, step);
  const auto growth = static_cast<float>(std::sqrt(static_cast<double>(step)));
  for (float& radius : sample.radii) radius *= growth;
  return sample;
}

PointCloud PointsToDraw(const MapReconstruction& map, std::size_t max_size) {
  if (!map.model.empty()) return SampleOf(map.model, max_size);
  PointCloud cloud;
  for (const SparsePoint& point : map.sparse.points) {
    if (!point.p_world.allFinite()) continue;
    cloud.points.push_back(point.p_world.cast<float>());
    cloud.colours.push_back(point.colour);
  }
  return SampleOf(cloud, max_size);
}

std::vector<CloudView> ViewsOf(const PointCloud& cloud, const MapReconstruction& map,
                               int width_px) {
  PointCloud some = SampleOf(cloud, kMaxForViews);
  if (some.empty()) {
    for (const TrajectoryEntry& entry : map.trajectory) {
      some.points.push_back(entry.T_world_cam.translation().cast<float>());
    }
  }
  if (some.empty()) return {};
  std::vector<CloudView> views = StandardCloudViews(some, width_px, KnownUp(map));
  for (CloudView& view : views) {
    view = WithPlaces(view, PlacesOf(map.trajectory),
                      view.name == views.front().name ? width_px : width_px / 2);
  }
  return views;
}

cv::Mat OverviewPicture(const Reconstruction& reconstruction, bool is_path) {
  if (reconstruction.maps.empty()) return PictureOfWords("No image has a pose: there is no model.");
  const MapReconstruction& map = reconstruction.maps[0];
  const PointCloud cloud = PointsToDraw(map, kMaxDrawn);
  const std::vector<CloudView> views = ViewsOf(cloud, map, kOverviewWidth_px);
  if (views.empty()) return PictureOfWords("No image has a pose: there is no model.");
  std::vector<cv::Mat> pictures;
  for (const CloudView& view : views) {
    cv::Mat picture =
        DrawPoints(cloud, view, [&](std::size_t i) { return ColourOfPoint(cloud, i); });
    DrawPath(map, view, is_path, picture);
    if (pictures.empty()) DrawScale(map, view, picture);
    pictures.push_back(WithName(picture, view.name));
  }
  const int height = std::max(pictures[1].rows, pictures[2].rows);
  cv::Mat sides;
  cv::hconcat(Padded(pictures[1], {kSmallWidth_px, height}),
              Padded(pictures[2], {kSmallWidth_px, height}), sides);
  cv::Mat overview;
  cv::vconcat(pictures[0], sides, overview);
  return overview;
}

std::optional<Eigen::Vector3d> KnownUp(const MapReconstruction& map) {
  if (!IsLevel(map.axes)) return std::nullopt;
  return Eigen::Vector3d::UnitZ();
}

cv::Mat NextViewsPicture(const MapReconstruction& map, const NextViews& next) {
  if (next.views.empty()) return {};
  const PointCloud cloud = PointsToDraw(map, kMaxDrawn);
  std::vector<Eigen::Vector3d> places = PlacesOf(map.trajectory);
  for (const NextView& proposed : next.views) {
    places.push_back(proposed.T_world_cam.translation());
  }
  CloudView view = ViewsOf(cloud, map, kCoverageWidth_px).front();
  view = WithPlaces(view, places, kCoverageWidth_px);
  cv::Mat picture = DrawPoints(cloud, view, [&](std::size_t i) {
    const cv::Vec3b colour = ColourOfPoint(cloud, i);  // pale, for the arrows to stand out
    return cv::Vec3b(colour / 2 + cv::Vec3b(127, 127, 127));
  });
  const auto pixel = [&](const Eigen::Vector3d& place) {
    const Eigen::Vector3d at = InView(view, place);
    return cv::Point(static_cast<int>(std::lround(std::clamp(at.x(), -1e4, 1e4))),
                     static_cast<int>(std::lround(std::clamp(at.y(), -1e4, 1e4))));
  };
  DrawScale(map, view, picture);
  for (std::size_t i = next.views.size(); i-- > 0;) {  // the first on top
    const cv::Point from = pixel(next.views[i].T_world_cam.translation());
    const cv::Point to = pixel(next.views[i].target_world);
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    for (const bool is_halo : {true, false}) {
      cv::arrowedLine(picture, from, to, is_halo ? kPathHalo : kNextView, is_halo ? 5 : 2,
                      cv::LINE_AA, 0, std::min(0.3, 10 / std::max(length, 1.0)));
    }
    cv::circle(picture, from, 10, kNextView, cv::FILLED, cv::LINE_AA);
    DrawText(picture, std::to_string(i + 1), {from.x + 0.0, from.y + 0.0}, TextAlign::kCentre, 9,
             kPathHalo);
  }
  return picture;
}

cv::Mat CoveragePicture(const MapReconstruction& map) {
  if (map.model.empty() || map.model.observations.empty()) return {};
  const PointCloud cloud = SampleOf(map.model, kMaxDrawn);
  const CloudView view = ViewsOf(cloud, map, kCoverageWidth_px).front();
  std::array<cv::Vec3b, kMaxCoverage + 1> colours;
  for (int i = 0; i <= kMaxCoverage; ++i) {
    colours.at(static_cast<std::size_t>(i)) =
        MapColour(cv::COLORMAP_VIRIDIS, static_cast<double>(i) / kMaxCoverage);
  }
  cv::Mat picture = DrawPoints(cloud, view, [&](std::size_t i) {
    return colours.at(std::min<std::uint32_t>(cloud.observations[i], kMaxCoverage));
  });
  DrawScale(map, view, picture);
  const int below = 46;
  cv::copyMakeBorder(picture, picture, 0, below, 0, 0, cv::BORDER_CONSTANT,
                     cv::Scalar(255, 255, 255));
  DrawColourBar(picture, {40, picture.rows - below + 10, kCoverageWidth_px / 2, 10},
                cv::COLORMAP_VIRIDIS,
                {{0.1, "1"}, {0.2, "2"}, {0.5, "5"}, {1, "10 or more depth maps"}});
  return picture;
}

}  // namespace mono3d::tools
