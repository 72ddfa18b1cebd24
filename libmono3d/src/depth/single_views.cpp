// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/single_views.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

namespace mono3d {
namespace {

// About as wide as the census window, 9 px, of images at a quarter of the resolution: what a false
// match there spoils.
constexpr int kDepthCell_px = 32;
// Share of the inverse depths of a cell at either end that may be wrong.
constexpr double kOutlierShareOfCell = 0.05;

struct Range {
  float farthest = 0;  // inverse depths, 1/su
  float nearest = 0;
};

// Also at all depths between: they lie on a line, and images are convex.
bool SeesAll(const SourceProjection& source, int x, int y, const Range& range) {
  return source.Sees({x, y}, range.farthest) && source.Sees({x, y}, range.nearest);
}

// The depth map in cells.
class Cells {
 public:
  explicit Cells(const cv::Mat& depth)
      : depth_(depth),
        num_columns_((depth.cols + kDepthCell_px - 1) / kDepthCell_px),
        num_rows_((depth.rows + kDepthCell_px - 1) / kDepthCell_px),
        typical_(static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_)) {}

  int num_columns() const { return num_columns_; }
  int num_rows() const { return num_rows_; }
  cv::Rect PixelsOf(int column, int row) const {
    return cv::Rect(column * kDepthCell_px, row * kDepthCell_px, kDepthCell_px, kDepthCell_px) &
           cv::Rect({}, depth_.size());
  }

  // Of all pixels of the cell; none: it has no depth.
  std::optional<Range> All(int column, int row) const {
    const std::vector<float> values = InverseDepths(column, row);
    if (values.empty()) return std::nullopt;
    const auto [farthest, nearest] = std::ranges::minmax(values);
    return Range{farthest, nearest};
  }

  // Without outliers, of the cell and those around it, of which one has depth.
  Range Around(int column, int row) {
    std::optional<Range> range;
    for (int y = std::max(0, row - 1); y <= std::min(num_rows_ - 1, row + 1); ++y) {
      for (int x = std::max(0, column - 1); x <= std::min(num_columns_ - 1, column + 1); ++x) {
        const std::optional<Range> of_cell = Typical(x, y);
        if (!of_cell) continue;
        range = !range ? *of_cell
                       : Range{std::min(range->farthest, of_cell->farthest),
                               std::max(range->nearest, of_cell->nearest)};
      }
    }
    return *range;
  }

 private:
  std::vector<float> InverseDepths(int column, int row) const {
    const cv::Rect pixels = PixelsOf(column, row);
    std::vector<float> values;
    for (int y = pixels.y; y < pixels.br().y; ++y) {
      const std::span<const float> depths_su(depth_.ptr<float>(y) + pixels.x,
                                             static_cast<std::size_t>(pixels.width));
      for (const float depth_su : depths_su) {
        if (depth_su > 0) values.push_back(1 / depth_su);
      }
    }
    return values;
  }

  std::optional<Range> Typical(int column, int row) {
    std::optional<std::optional<Range>>& typical =
        typical_[static_cast<std::size_t>(row) * static_cast<std::size_t>(num_columns_) +
                 static_cast<std::size_t>(column)];
    if (typical) return *typical;
    typical.emplace();
    std::vector<float> values = InverseDepths(column, row);
    if (values.empty()) return *typical;
    const auto at = [&](double share) {
      const auto index = static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
      std::ranges::nth_element(values, values.begin() + index);
      return values[static_cast<std::size_t>(index)];
    };
    *typical = Range{at(kOutlierShareOfCell), at(1 - kOutlierShareOfCell)};
    return *typical;
  }

  const cv::Mat& depth_;
  int num_columns_;
  int num_rows_;
  std::vector<std::optional<std::optional<Range>>> typical_;  // as far as they were asked for
};

bool SeesAll(const SourceProjection& source, const cv::Rect& pixels, const Range& range) {
  const cv::Point last = pixels.br() - cv::Point(1, 1);
  return SeesAll(source, pixels.x, pixels.y, range) && SeesAll(source, last.x, pixels.y, range) &&
         SeesAll(source, pixels.x, last.y, range) && SeesAll(source, last.x, last.y, range);
}

// The only source that sees the point.
const SourceProjection* OnlySource(const SourceProjections& sources, int x, int y,
                                   float inverse_depth) {
  const SourceProjection* single = nullptr;
  for (const SourceProjection& source : sources) {
    if (!source.Sees({x, y}, inverse_depth)) continue;
    if (single != nullptr) return nullptr;
    single = &source;
  }
  return single;
}

}  // namespace

cv::Mat FindSingleViews(const SweepGeometry& geometry, const cv::Mat& depth) {
  const SourceProjections sources = geometry.Projections(0);
  cv::Mat views(depth.size(), CV_8UC1, cv::Scalar(kNotSingle));
  Cells cells(depth);
  for (int row = 0; row < cells.num_rows(); ++row) {
    for (int column = 0; column < cells.num_columns(); ++column) {
      const std::optional<Range> all = cells.All(column, row);
      if (!all) continue;
      const cv::Rect pixels = cells.PixelsOf(column, row);
      const auto num_whole = std::ranges::count_if(
          sources, [&](const SourceProjection& source) { return SeesAll(source, pixels, *all); });
      if (num_whole >= 2) continue;
      const Range around = cells.Around(column, row);
      for (int y = pixels.y; y < pixels.br().y; ++y) {
        for (int x = pixels.x; x < pixels.br().x; ++x) {
          const float depth_su = depth.at<float>(y, x);
          if (!(depth_su > 0)) continue;
          const SourceProjection* single = OnlySource(sources, x, y, 1 / depth_su);
          if (single == nullptr) continue;
          views.at<std::uint8_t>(y, x) = SeesAll(*single, x, y, around) ? kSingle : kDoubtfulSingle;
        }
      }
    }
  }
  return views;
}

}  // namespace mono3d
