// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/height_window.h"

#include <algorithm>
#include <cmath>

namespace mono3d {
namespace {

constexpr int kBlock = 16;  // cells a side that a ray may pass at once

// A surface that rises less than this above a line of sight is the noise of its heights, in cells.
constexpr double kHiddenBy_cells = 2;

}  // namespace

HeightWindow::HeightWindow(const HeightSource& source, const Eigen::AlignedBox2d& part,
                           double margin)
    : height_units_(source.grid.cell) {
  const RasterGrid& whole = source.grid;
  const Eigen::Vector2d north_west =
      whole.ToCell({part.min().x() - margin, part.max().y() + margin});
  const Eigen::Vector2d south_east =
      whole.ToCell({part.max().x() + margin, part.min().y() - margin});
  const auto clamped = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  const int left = clamped(std::floor(north_west.x()) - 1, whole.width);
  const int top = clamped(std::floor(north_west.y()) - 1, whole.height);
  const int right = clamped(std::ceil(south_east.x()) + 2, whole.width);
  const int bottom = clamped(std::ceil(south_east.y()) + 2, whole.height);
  grid_ = {.west = whole.west + left * whole.cell,
           .north = whole.north - top * whole.cell,
           .cell = whole.cell,
           .width = std::max(0, right - left),
           .height = std::max(0, bottom - top)};
  if (grid_.width == 0 || grid_.height == 0) return;
  heights_ = source.read({left, top, grid_.width, grid_.height});
  FindBlockHeights();
}

void HeightWindow::FindBlockHeights() {
  highest_of_blocks_.create((grid_.height + kBlock - 1) / kBlock,
                            (grid_.width + kBlock - 1) / kBlock, CV_32FC1);
  highest_of_blocks_.setTo(kNoHeight);
  for (int row = 0; row < grid_.height; ++row) {
    for (int column = 0; column < grid_.width; ++column) {
      const float height = heights_.at<float>(row, column);
      if (height == kNoHeight) continue;
      float& of_block = highest_of_blocks_.at<float>(row / kBlock, column / kBlock);
      of_block = of_block == kNoHeight ? height : std::max(of_block, height);
      lowest_ = lowest_ == kNoHeight ? height : std::min(lowest_, height);
      highest_ = highest_ == kNoHeight ? height : std::max(highest_, height);
    }
  }
}

float HeightWindow::At(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d cell = grid_.ToCell(place);
  const double left = std::floor(cell.x() + 1e-6), top = std::floor(cell.y() + 1e-6);
  const double dx = std::max(0.0, cell.x() - left), dy = std::max(0.0, cell.y() - top);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const double weight = (k % 2 == 1 ? dx : 1 - dx) * (k / 2 == 1 ? dy : 1 - dy);
    if (weight < 1e-3) continue;
    const auto column = static_cast<int>(left) + k % 2, row = static_cast<int>(top) + k / 2;
    if (column < 0 || row < 0 || column >= grid_.width || row >= grid_.height) return kNoHeight;
    const float height = heights_.at<float>(row, column);
    if (height == kNoHeight) return kNoHeight;
    sum += weight * height;
  }
  return static_cast<float>(sum);
}

bool HeightWindow::IsHidden(const Eigen::Vector3d& place, const Eigen::Vector3d& eye) const {
  const Eigen::Vector2d from = grid_.ToCell(place.head<2>());
  const Eigen::Vector2d to = grid_.ToCell(eye.head<2>());
  const Eigen::Vector2d across = to - from;
  // A cell at a time along the longer direction.
  const double num_steps = across.cwiseAbs().maxCoeff();
  if (!(num_steps > 1)) return false;
  const Eigen::Vector2d step = across / num_steps;
  const double rise = (eye.z() - place.z()) / num_steps;
  const double tolerance = kHiddenBy_cells * height_units_;
  for (double t = 1; t < num_steps;) {
    const double height = place.z() + t * rise;
    if (height > highest_) return false;
    const Eigen::Vector2d cell = from + t * step;
    const auto column = static_cast<int>(std::lround(cell.x()));
    const auto row = static_cast<int>(std::lround(cell.y()));
    if (column < 0 || row < 0 || column >= grid_.width || row >= grid_.height) return false;
    if (height > highest_of_blocks_.at<float>(row / kBlock, column / kBlock)) {
      // On to where the ray leaves the block.
      const auto steps_in_block = [](double at, double direction, int index) {
        if (direction == 0) return 1e9;
        const double edge = index / kBlock * kBlock + (direction > 0 ? kBlock - 0.5 : -0.5);
        return (edge - at) / direction;
      };
      t += std::max(1.0, std::ceil(std::min(steps_in_block(cell.x(), step.x(), column),
                                            steps_in_block(cell.y(), step.y(), row))));
      continue;
    }
    if (heights_.at<float>(row, column) > height + tolerance) return true;
    t += 1;
  }
  return false;
}

}  // namespace mono3d
