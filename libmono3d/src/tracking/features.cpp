// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace mono3d::tracking {
namespace {

// The rotated pattern of ORB reaches 13 * sqrt(2) px out, its smoothing 3 px more.
constexpr int kBorder = 22;
constexpr int kPatchRadius = 15;  // of the orientation
constexpr int kCell = 32;         // px, of detection

using KeyPoints = std::vector<cv::KeyPoint>;

// FAST in cells, so that weak texture gets its own, lower threshold.
KeyPoints DetectInCells(const cv::Mat& image, const FeatureOptions& options) {
  constexpr int kFastRadius = 3;
  KeyPoints all;
  KeyPoints in_cell;
  for (int y = kBorder; y < image.rows - kBorder; y += kCell) {
    for (int x = kBorder; x < image.cols - kBorder; x += kCell) {
      const cv::Rect cell(x, y, std::min(kCell, image.cols - kBorder - x),
                          std::min(kCell, image.rows - kBorder - y));
      // One px more than the radius: non-maximum suppression looks at the neighbours.
      const int margin = kFastRadius + 1;
      const cv::Rect seen(cell.x - margin, cell.y - margin, cell.width + 2 * margin,
                          cell.height + 2 * margin);
      for (const int threshold : {options.fast_threshold, options.min_fast_threshold}) {
        cv::FAST(image(seen), in_cell, threshold, true);
        if (!in_cell.empty()) break;
      }
      for (cv::KeyPoint& point : in_cell) {
        point.pt.x += static_cast<float>(seen.x);
        point.pt.y += static_cast<float>(seen.y);
        if (cell.contains(cv::Point(cvRound(point.pt.x), cvRound(point.pt.y)))) {
          all.push_back(point);
        }
      }
    }
  }
  return all;
}

// Keeps the strongest points that are at least `distance` px apart, on a grid of half that size.
KeyPoints Suppress(const KeyPoints& sorted, double distance, const cv::Size& size) {
  const double cell = distance / 2;
  const int columns = static_cast<int>(size.width / cell) + 1;
  const int rows = static_cast<int>(size.height / cell) + 1;
  std::vector<char> covered(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  KeyPoints kept;
  for (const cv::KeyPoint& point : sorted) {
    const int column = static_cast<int>(point.pt.x / cell);
    const int row = static_cast<int>(point.pt.y / cell);
    const auto at = [&](int c, int r) -> char& {
      return covered[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(c)];
    };
    if (at(column, row) != 0) continue;
    kept.push_back(point);
    constexpr int kReach = 2;
    for (int r = std::max(0, row - kReach); r <= std::min(rows - 1, row + kReach); ++r) {
      for (int c = std::max(0, column - kReach); c <= std::min(columns - 1, column + kReach); ++c) {
        at(c, r) = 1;
      }
    }
  }
  return kept;
}

// About `wanted` points, as evenly spread as that number allows: suppression via square covering
// (Bailo, Rameau, Joo, Park, Bogdan, Kweon 2018).
KeyPoints Spread(KeyPoints points, std::size_t wanted, const cv::Size& size) {
  if (points.size() <= wanted) return points;
  std::stable_sort(points.begin(), points.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    return a.response > b.response;
  });
  double low = 2;  // px
  double high = std::max(size.width, size.height);
  KeyPoints best(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(wanted));
  constexpr int kMaxHalvings = 12;
  for (int i = 0; i < kMaxHalvings; ++i) {
    const double distance = 0.5 * (low + high);
    KeyPoints kept = Suppress(points, distance, size);
    const bool enough = kept.size() >= wanted;
    const bool close = kept.size() <= wanted + wanted / 20;  // 5 % more than wanted will do
    if (enough) best = std::move(kept);
    if (enough && close) break;
    (enough ? low : high) = distance;
  }
  return best;
}

// The last column of each row of the disc of radius kPatchRadius.
std::array<int, kPatchRadius + 1> DiscColumns() {
  std::array<int, kPatchRadius + 1> columns{};
  for (int row = 0; row <= kPatchRadius; ++row) {
    columns[static_cast<std::size_t>(row)] =
        static_cast<int>(std::lround(std::sqrt(kPatchRadius * kPatchRadius - row * row)));
  }
  return columns;
}

// Direction from the centre of the patch to its centroid of brightness (Rosin 1999), in degrees.
float Orientation(const cv::Mat& image, const cv::Point& centre) {
  static const std::array<int, kPatchRadius + 1> kColumns = DiscColumns();
  int moment_x = 0;
  int moment_y = 0;
  for (int dy = -kPatchRadius; dy <= kPatchRadius; ++dy) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(centre.y + dy) + centre.x;
    const int reach = kColumns[static_cast<std::size_t>(std::abs(dy))];
    int sum = 0;
    for (int dx = -reach; dx <= reach; ++dx) {
      moment_x += dx * row[dx];
      sum += row[dx];
    }
    moment_y += dy * sum;
  }
  return cv::fastAtan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
}

// Describes the points of one level and appends them, in pixels of the full image.
void Describe(const cv::Mat& image, int level, const cv::Size& full_size, KeyPoints points,
              std::vector<Feature>& features) {
  for (cv::KeyPoint& point : points) {
    point.angle = Orientation(image, cv::Point(cvRound(point.pt.x), cvRound(point.pt.y)));
    point.octave = 0;
  }
  // A one-level ORB with a border inside ours drops no point and keeps their order.
  const cv::Ptr<cv::ORB> orb =
      cv::ORB::create(static_cast<int>(points.size()), 1.2F, 1, kBorder - 1);
  cv::Mat descriptors;
  orb->compute(image, points, descriptors);
  const double scale_x = static_cast<double>(full_size.width) / image.cols;
  const double scale_y = static_cast<double>(full_size.height) / image.rows;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Feature feature;
    feature.pixel = {(points[i].pt.x + 0.5) * scale_x - 0.5,
                     (points[i].pt.y + 0.5) * scale_y - 0.5};
    feature.level = level;
    feature.angle_deg = points[i].angle;
    feature.response = points[i].response;
    std::memcpy(feature.descriptor.data(), descriptors.ptr(static_cast<int>(i)),
                sizeof(feature.descriptor));
    features.push_back(feature);
  }
}

}  // namespace

PyramidScales::PyramidScales(const FeatureOptions& options) : factor_(options.scale_factor) {
  for (int level = 0; level < options.num_levels; ++level) {
    scales_.push_back(std::pow(factor_, level));
  }
}

int PyramidScales::Predict(double distance, double max_distance) const {
  const double level = std::log(max_distance / distance) / std::log(factor_);
  return std::clamp(static_cast<int>(std::ceil(level)), 0, num_levels() - 1);
}

FeatureGrid::FeatureGrid(const std::vector<Feature>& features, int width, int height)
    : num_columns_(width / kCell + 1), num_rows_(height / kCell + 1) {
  const auto cell_of = [&](const Feature& feature) {
    const int column = std::clamp(static_cast<int>(feature.pixel.x()) / kCell, 0, num_columns_ - 1);
    const int row = std::clamp(static_cast<int>(feature.pixel.y()) / kCell, 0, num_rows_ - 1);
    return static_cast<std::size_t>(row * num_columns_ + column);
  };
  first_of_cell_.assign(static_cast<std::size_t>(num_columns_ * num_rows_) + 1, 0);
  for (const Feature& feature : features) ++first_of_cell_[cell_of(feature) + 1];
  for (std::size_t i = 1; i < first_of_cell_.size(); ++i)
    first_of_cell_[i] += first_of_cell_[i - 1];
  std::vector<std::size_t> next(first_of_cell_.begin(), first_of_cell_.end() - 1);
  entries_.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    entries_[next[cell_of(features[i])]++] = {features[i].pixel.cast<float>(), features[i].level,
                                              i};
  }
}

void FeatureGrid::Find(const Eigen::Vector2d& pixel, double radius_px, int min_level, int max_level,
                       std::vector<std::size_t>& found) const {
  const auto column_of = [](double coordinate, int count) {
    return std::clamp(static_cast<int>(std::floor(coordinate / kCell)), 0, count - 1);
  };
  const int first_column = column_of(pixel.x() - radius_px, num_columns_);
  const int last_column = column_of(pixel.x() + radius_px, num_columns_);
  const int first_row = column_of(pixel.y() - radius_px, num_rows_);
  const int last_row = column_of(pixel.y() + radius_px, num_rows_);
  const Eigen::Vector2f centre = pixel.cast<float>();
  const auto radius = static_cast<float>(radius_px);
  for (int row = first_row; row <= last_row; ++row) {
    const auto cell = static_cast<std::size_t>(row * num_columns_ + first_column);
    const std::size_t end =
        first_of_cell_[cell + static_cast<std::size_t>(last_column - first_column) + 1];
    for (std::size_t i = first_of_cell_[cell]; i < end; ++i) {
      const Entry& entry = entries_[i];
      if (entry.level < min_level || entry.level > max_level) continue;
      if (std::abs(entry.pixel.x() - centre.x()) > radius) continue;
      if (std::abs(entry.pixel.y() - centre.y()) > radius) continue;
      found.push_back(entry.index);
    }
  }
}

std::vector<Feature> ExtractFeatures(const cv::Mat& grey, const FeatureOptions& options,
                                     int num_features) {
  // Features in proportion to the width of a level: equal distances in px of each level would give
  // its area, and the coarse levels would hold too few to bridge a change of scale.
  const PyramidScales scales(options);
  double sum = 0;
  for (int level = 0; level < scales.num_levels(); ++level) sum += 1 / scales.Scale(level);
  std::vector<Feature> features;
  features.reserve(static_cast<std::size_t>(num_features) * 11 / 10);
  cv::Mat image = grey;
  for (int level = 0; level < scales.num_levels(); ++level) {
    if (level > 0) {
      const cv::Size size(cvRound(grey.cols / scales.Scale(level)),
                          cvRound(grey.rows / scales.Scale(level)));
      cv::Mat smaller;
      cv::resize(image, smaller, size, 0, 0, cv::INTER_LINEAR);
      image = smaller;
    }
    if (std::min(image.cols, image.rows) <= 2 * kBorder) break;
    const double share = 1 / scales.Scale(level) / sum;
    const auto wanted = static_cast<std::size_t>(std::lround(num_features * share));
    KeyPoints points = Spread(DetectInCells(image, options), wanted, image.size());
    if (!points.empty()) Describe(image, level, grey.size(), std::move(points), features);
  }
  return features;
}

}  // namespace mono3d::tracking
