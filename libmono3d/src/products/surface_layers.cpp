// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/surface_layers.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mono3d/products/surface_model.h"

namespace mono3d {
namespace {

// A disc seen at a flatter angle from above shows nothing of what a map shows, and its height over
// a neighbouring cell is a guess.
constexpr float kMinUpwards = 0.1F;

// A surface counts if it has this share of what speaks for the best one of its cell: something real
// above the ground hides the ground, so that most depth maps see it; what floats, few do.
constexpr float kShareOfBest = 0.25F;

// Patches up to this size are what a surfel or two that are wrong draw.
constexpr std::size_t kMaxFloatingCells = 12;

}  // namespace

SurfaceLayers::SurfaceLayers(const RasterGrid& grid, int first_row, int num_rows,
                             double height_units)
    : grid_(grid),
      first_row_(first_row),
      num_rows_(num_rows),
      height_units_(height_units),
      gap_(static_cast<float>(kSurfaceGap_cells * height_units)),
      cells_(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(num_rows)) {}

void SurfaceLayers::Draw(const MapSurfelBlock& surfels, double radius_scale) {
  const PointCloud& cloud = surfels.cloud;
  for (std::size_t i = 0; i < surfels.points.size(); ++i) {
    const Eigen::Vector3f normal =
        surfels.normals.empty() ? Eigen::Vector3f::UnitZ() : surfels.normals[i];
    if (!(normal.z() > kMinUpwards)) continue;
    const double radius = cloud.radii.empty() ? 0 : cloud.radii[i] * radius_scale / grid_.cell;
    const Eigen::Vector2d centre = grid_.ToCell(surfels.points[i].head<2>());
    // A disc smaller than a cell still shows the cell it lies in: to the cell's corner.
    const double reach = std::max(radius, std::sqrt(0.5));
    const double row = centre.y() - first_row_;
    // The disc may lie anywhere, also far outside.
    const auto within = [](double cell, int size) {
      return static_cast<int>(std::clamp(cell, -1.0, static_cast<double>(size)));
    };
    const int top = std::max(0, within(std::ceil(row - reach), num_rows_));
    const int bottom = std::min(num_rows_ - 1, within(std::floor(row + reach), num_rows_));
    const int left = std::max(0, within(std::ceil(centre.x() - reach), grid_.width));
    const int right =
        std::min(grid_.width - 1, within(std::floor(centre.x() + reach), grid_.width));
    const float confidence = cloud.confidences.empty() ? 1 : cloud.confidences[i];
    // Rows go southwards.
    const double slope_x = -normal.x() / normal.z() * height_units_;
    const double slope_y = normal.y() / normal.z() * height_units_;
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const double dx = x - centre.x(), dy = y - row;
        const double rise = slope_x * dx + slope_y * dy;
        // Within the disc itself, not its shadow: along the slope it reaches less far on the map.
        const double off = dx * dx + dy * dy + (rise / height_units_) * (rise / height_units_);
        const double in_cell = std::max(std::abs(dx), std::abs(dy));
        if (off > radius * radius && in_cell > 0.5) continue;
        const double nearness = std::exp(-2 * off / (reach * reach));
        const auto weight = static_cast<float>(confidence * normal.z() * nearness);
        if (!(weight > 0)) continue;
        const double height = surfels.points[i].z() + (off > radius * radius ? 0 : rise);
        Add(cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) +
                   static_cast<std::size_t>(x)],
            static_cast<float>(height), weight);
      }
    }
  }
}

void SurfaceLayers::Add(Cell& cell, float height, float weight) const {
  Layer* nearest = nullptr;
  float distance = std::numeric_limits<float>::infinity();
  for (Layer& layer : cell) {
    if (layer.weight == 0) {
      if (distance <= gap_) break;
      layer = {height, weight};
      return;
    }
    if (std::abs(layer.height - height) < distance) {
      distance = std::abs(layer.height - height);
      nearest = &layer;
    }
  }
  if (distance > gap_) {
    // A fourth surface: the one with the least for it gives way, if it has less.
    Layer& least = *std::ranges::min_element(cell, {}, &Layer::weight);
    if (least.weight < weight) least = {height, weight};
    return;
  }
  nearest->weight += weight;
  nearest->height += weight / nearest->weight * (height - nearest->height);
}

float SurfaceLayers::SupportOf(int row, int column, float height) const {
  float support = 0;
  for (int y = std::max(0, row - 1); y <= std::min(num_rows_ - 1, row + 1); ++y) {
    for (int x = std::max(0, column - 1); x <= std::min(grid_.width - 1, column + 1); ++x) {
      const Cell& cell =
          cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) +
                 static_cast<std::size_t>(x)];
      for (const Layer& layer : cell) {
        if (std::abs(layer.height - height) <= gap_) support += layer.weight;
      }
    }
  }
  return support;
}

cv::Mat SurfaceLayers::Heights() const {
  cv::Mat heights(num_rows_, grid_.width, CV_32FC1, cv::Scalar(kNoHeight));
  for (int row = 0; row < num_rows_; ++row) {
    for (int column = 0; column < grid_.width; ++column) {
      const Cell& cell =
          cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.width) +
                 static_cast<std::size_t>(column)];
      if (cell[0].weight == 0) continue;
      float& height = heights.at<float>(row, column);
      height = cell[0].height;
      if (cell[1].weight == 0) continue;
      std::array<float, 3> support{};
      float best = 0;
      for (std::size_t k = 0; k < cell.size() && cell[k].weight > 0; ++k) {
        support[k] = SupportOf(row, column, cell[k].height);
        best = std::max(best, support[k]);
      }
      height = -std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < cell.size(); ++k) {
        if (support[k] >= kShareOfBest * best && cell[k].weight > 0) {
          height = std::max(height, cell[k].height);
        }
      }
    }
  }
  return heights;
}

void RemoveFloatingPatches(cv::Mat& heights, float gap) {
  cv::Mat seen(heights.size(), CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> patch;
  constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  const cv::Rect inside(0, 0, heights.cols, heights.rows);
  for (int row = 0; row < heights.rows; ++row) {
    for (int column = 0; column < heights.cols; ++column) {
      if (seen.at<std::uint8_t>(row, column) != 0) continue;
      seen.at<std::uint8_t>(row, column) = 1;
      if (heights.at<float>(row, column) == kNoHeight) continue;
      patch.assign(1, {column, row});
      bool touches_border = false;
      for (std::size_t i = 0; i < patch.size(); ++i) {
        const cv::Point cell = patch[i];
        const float height = heights.at<float>(cell);
        for (const auto& [dx, dy] : kAround) {
          const cv::Point next(cell.x + dx, cell.y + dy);
          if (!inside.contains(next)) {
            touches_border = true;
            continue;
          }
          const float other = heights.at<float>(next);
          if (other == kNoHeight || std::abs(other - height) > gap) continue;
          if (seen.at<std::uint8_t>(next) != 0) continue;
          seen.at<std::uint8_t>(next) = 1;
          patch.push_back(next);
        }
      }
      if (touches_border || patch.size() > kMaxFloatingCells) continue;
      for (const cv::Point& cell : patch) heights.at<float>(cell) = kNoHeight;
    }
  }
}

void ClosePinholes(cv::Mat& heights) {
  // Twice: gaps of two cells. Most around must be known, so that outer borders stay.
  constexpr int kRounds = 2;
  constexpr std::size_t kMinKnown = 5;
  std::vector<float> around;
  for (int round = 0; round < kRounds; ++round) {
    const cv::Mat before = heights.clone();
    for (int row = 1; row + 1 < heights.rows; ++row) {
      for (int column = 1; column + 1 < heights.cols; ++column) {
        if (before.at<float>(row, column) != kNoHeight) continue;
        around.clear();
        for (int y = row - 1; y <= row + 1; ++y) {
          for (int x = column - 1; x <= column + 1; ++x) {
            const float height = before.at<float>(y, x);
            if (height != kNoHeight) around.push_back(height);
          }
        }
        if (around.size() < kMinKnown) continue;
        // The median does not mix a roof with the ground.
        std::ranges::nth_element(around, around.begin() + around.size() / 2);
        heights.at<float>(row, column) = around[around.size() / 2];
      }
    }
  }
}

}  // namespace mono3d
