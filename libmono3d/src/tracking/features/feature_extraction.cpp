// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/feature_extraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "tracking/features/pyramid_scales.h"

namespace mono3d::tracking {
namespace {

// The rotated pattern of ORB reaches 13 * sqrt(2) px out, its smoothing 3 px more.
constexpr int kBorder = 22;
constexpr int kPatchRadius = 15;  // px, of the orientation: ORB's own (its patch of 31)
constexpr int kCell = 32;         // px, of detection: about that patch

using KeyPoints = std::vector<cv::KeyPoint>;

// FAST within `cell`.
void DetectIn(const cv::Mat& image, const cv::Rect& cell, int threshold, KeyPoints& found) {
  constexpr int kFastRadius = 3;  // of the circle of FAST-9
  // One px more than the radius: non-maximum suppression looks at the neighbours.
  constexpr int kMargin = kFastRadius + 1;
  const cv::Rect seen(cell.x - kMargin, cell.y - kMargin, cell.width + 2 * kMargin,
                      cell.height + 2 * kMargin);
  cv::FAST(image(seen), found, threshold, true);
  std::erase_if(found, [&](cv::KeyPoint& point) {
    point.pt += cv::Point2f(static_cast<float>(seen.x), static_cast<float>(seen.y));
    return !cell.contains(cv::Point(cvRound(point.pt.x), cvRound(point.pt.y)));
  });
}

// FAST over the whole image at twice the threshold, which is enough for rich texture; then at lower
// ones in the cells that it leaves empty, so that weak texture gets its own.
KeyPoints DetectInCells(const cv::Mat& image, const FeatureOptions& options) {
  const cv::Rect inside(kBorder, kBorder, image.cols - 2 * kBorder, image.rows - 2 * kBorder);
  KeyPoints all;
  DetectIn(image, inside, 2 * options.fast_threshold, all);
  const int num_columns = (inside.width + kCell - 1) / kCell;
  const int num_rows = (inside.height + kCell - 1) / kCell;
  std::vector<char> is_filled(static_cast<std::size_t>(num_columns * num_rows), 0);
  for (const cv::KeyPoint& point : all) {
    const int column = (cvRound(point.pt.x) - kBorder) / kCell;
    const int row = (cvRound(point.pt.y) - kBorder) / kCell;
    is_filled[static_cast<std::size_t>(row * num_columns + column)] = 1;
  }
  KeyPoints in_cell;
  for (int row = 0; row < num_rows; ++row) {
    for (int column = 0; column < num_columns; ++column) {
      if (is_filled[static_cast<std::size_t>(row * num_columns + column)] != 0) continue;
      const cv::Rect cell =
          cv::Rect(kBorder + column * kCell, kBorder + row * kCell, kCell, kCell) & inside;
      for (const int threshold : {options.fast_threshold, options.min_fast_threshold}) {
        DetectIn(image, cell, threshold, in_cell);
        if (!in_cell.empty()) break;
      }
      all.insert(all.end(), in_cell.begin(), in_cell.end());
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
    constexpr int kReach = 2;  // cells of half the distance
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
  constexpr int kMaxHalvings = 12;  // of 4000 px: to one px
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

// One level of the pyramid, and how its pixels lie in the full image.
struct Level {
  cv::Mat image;
  int index = 0;
  double scale_x = 1;
  double scale_y = 1;

  Eigen::Vector2d InFullImage(const cv::Point2f& pt) const {
    return {(pt.x + 0.5) * scale_x - 0.5, (pt.y + 0.5) * scale_y - 0.5};
  }
  cv::Point2f InLevel(const Eigen::Vector2d& pixel) const {
    return {static_cast<float>((pixel.x() + 0.5) / scale_x - 0.5),
            static_cast<float>((pixel.y() + 0.5) / scale_y - 0.5)};
  }
};

// Descriptors of the points of one level, which gain their orientation. All are inside the border.
cv::Mat Describe(const cv::Mat& image, KeyPoints& points) {
  for (cv::KeyPoint& point : points) {
    point.angle = Orientation(image, cv::Point(cvRound(point.pt.x), cvRound(point.pt.y)));
    point.octave = 0;
  }
  // A one-level ORB with a border inside ours drops no point and keeps their order.
  const cv::Ptr<cv::ORB> orb =
      cv::ORB::create(static_cast<int>(points.size()), 1.2F, 1, kBorder - 1);
  cv::Mat descriptors;
  orb->compute(image, points, descriptors);
  return descriptors;
}

void SetDescription(const cv::KeyPoint& point, const cv::Mat& descriptors, std::size_t row,
                    Feature& feature) {
  feature.angle_deg = point.angle;
  std::memcpy(feature.descriptor.data(), descriptors.ptr(static_cast<int>(row)),
              sizeof(feature.descriptor));
}

// Which parts of the full image are taken by known features, in squares of a few px.
class Occupancy {
 public:
  Occupancy(std::span<const Feature> known, const cv::Size& size, double distance_px)
      : num_columns_(size.width / kSquare + 1),
        num_rows_(size.height / kSquare + 1),
        taken_(static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_), 0) {
    const int reach = std::max(0, static_cast<int>(std::lround(distance_px / kSquare)));
    for (const Feature& feature : known) {
      const int column = static_cast<int>(feature.pixel.x()) / kSquare;
      const int row = static_cast<int>(feature.pixel.y()) / kSquare;
      for (int r = std::max(0, row - reach); r <= std::min(num_rows_ - 1, row + reach); ++r) {
        for (int c = std::max(0, column - reach); c <= std::min(num_columns_ - 1, column + reach);
             ++c) {
          taken_[Index(c, r)] = 1;
        }
      }
    }
  }
  bool IsTaken(const Eigen::Vector2d& pixel) const {
    const int column = static_cast<int>(pixel.x()) / kSquare;
    const int row = static_cast<int>(pixel.y()) / kSquare;
    return taken_[Index(column, row)] != 0;
  }

 private:
  static constexpr int kSquare = 4;  // px
  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(num_columns_) +
           static_cast<std::size_t>(column);
  }
  int num_columns_;
  int num_rows_;
  std::vector<char> taken_;
};

// Fills the known features of one level and appends the new ones.
void DescribeLevel(const Level& level, const KeyPoints& detected, std::size_t num_known,
                   double sigma_px, std::vector<Feature>& features) {
  KeyPoints points;
  std::vector<std::size_t> of_feature;  // the known ones that can be described
  const cv::Rect inside(kBorder, kBorder, level.image.cols - 2 * kBorder,
                        level.image.rows - 2 * kBorder);
  for (std::size_t i = 0; i < num_known; ++i) {
    if (features[i].level != level.index) continue;
    const cv::Point2f pt = level.InLevel(features[i].pixel);
    const cv::Point rounded(cvRound(pt.x), cvRound(pt.y));
    if (!inside.contains(rounded)) continue;
    points.emplace_back(cv::Point2f(rounded), 31.0F);
    of_feature.push_back(i);
  }
  points.insert(points.end(), detected.begin(), detected.end());
  if (points.empty()) return;
  const cv::Mat descriptors = Describe(level.image, points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k < of_feature.size()) {
      SetDescription(points[k], descriptors, k, features[of_feature[k]]);
      continue;
    }
    Feature& feature = features.emplace_back();
    feature.pixel = level.InFullImage(points[k].pt);
    feature.level = level.index;
    feature.response = points[k].response;
    feature.sigma_px = sigma_px;
    SetDescription(points[k], descriptors, k, feature);
  }
}

}  // namespace

std::vector<Feature> ExtractFeatures(const cv::Mat& grey, const FeatureOptions& options,
                                     int num_features, std::span<const Feature> known) {
  // Features in proportion to the width of a level: equal distances in px of each level would give
  // its area, and the coarse levels would hold too few to bridge a change of scale.
  const PyramidScales scales(options);
  double sum = 0;
  for (int level = 0; level < scales.num_levels(); ++level) sum += 1 / scales.Scale(level);
  std::vector<std::size_t> num_known_on(static_cast<std::size_t>(scales.num_levels()), 0);
  for (const Feature& feature : known) ++num_known_on[static_cast<std::size_t>(feature.level)];
  // Half the distance at which so many points would lie if spread evenly.
  const Occupancy occupancy(known, grey.size(),
                            0.5 * std::sqrt(static_cast<double>(grey.total()) / num_features));
  std::vector<Feature> features(known.begin(), known.end());
  features.reserve(static_cast<std::size_t>(num_features) * 11 / 10 + known.size());
  Level level{grey, 0, 1, 1};
  for (; level.index < scales.num_levels(); ++level.index) {
    const double scale = scales.Scale(level.index);
    if (level.index > 0) {
      const cv::Size size(cvRound(grey.cols / scale), cvRound(grey.rows / scale));
      cv::Mat smaller;
      cv::resize(level.image, smaller, size, 0, 0, cv::INTER_LINEAR);
      level = {smaller, level.index, static_cast<double>(grey.cols) / size.width,
               static_cast<double>(grey.rows) / size.height};
    }
    if (std::min(level.image.cols, level.image.rows) <= 2 * kBorder) break;
    const auto share = static_cast<std::size_t>(std::lround(num_features / scale / sum));
    const std::size_t num_known = num_known_on[static_cast<std::size_t>(level.index)];
    KeyPoints points;
    if (share > num_known) {
      points = DetectInCells(level.image, options);
      std::erase_if(points, [&](const cv::KeyPoint& point) {
        return occupancy.IsTaken(level.InFullImage(point.pt));
      });
      points = Spread(std::move(points), share - num_known, level.image.size());
    }
    DescribeLevel(level, points, known.size(), scale, features);
  }
  return features;
}

}  // namespace mono3d::tracking
