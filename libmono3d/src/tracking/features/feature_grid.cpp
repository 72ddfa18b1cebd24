// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/feature_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/clamped_int.h"
#include "geometry/geometry_state.h"
#include "image/state_archive.h"

namespace mono3d::tracking {
namespace {

constexpr int kGridCell = 32;  // px: about the radius of the searches

}  // namespace

FeatureGrid::FeatureGrid(const std::vector<Feature>& features, int width, int height)
    : FeatureGrid(features, width, height, [](std::size_t) { return true; }) {}

FeatureGrid::FeatureGrid(const std::vector<Feature>& features, int width, int height,
                         const std::function<bool(std::size_t)>& use)
    : num_columns_(width / kGridCell + 1), num_rows_(height / kGridCell + 1) {
  const auto cell_of = [&](const Feature& feature) {
    const int column = ClampedInt(feature.pixel.x() / kGridCell, 0, num_columns_ - 1);
    const int row = ClampedInt(feature.pixel.y() / kGridCell, 0, num_rows_ - 1);
    return static_cast<std::size_t>(row * num_columns_ + column);
  };
  first_of_cell_.assign(static_cast<std::size_t>(num_columns_ * num_rows_) + 1, 0);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (use(i)) ++first_of_cell_[cell_of(features[i]) + 1];
  }
  for (std::size_t i = 1; i < first_of_cell_.size(); ++i)
    first_of_cell_[i] += first_of_cell_[i - 1];
  std::vector<std::size_t> next(first_of_cell_.begin(), first_of_cell_.end() - 1);
  entries_.resize(first_of_cell_.back());
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!use(i)) continue;
    entries_[next[cell_of(features[i])]++] = {features[i].pixel.cast<float>(), features[i].level,
                                              i};
  }
}

void FeatureGrid::Find(const Eigen::Vector2d& pixel, double radius_px, int min_level, int max_level,
                       std::vector<std::size_t>& found) const {
  const auto column_of = [](double coordinate, int count) {
    return ClampedInt(coordinate / kGridCell, 0, count - 1);
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
      if (!(std::abs(entry.pixel.x() - centre.x()) <= radius)) continue;
      if (!(std::abs(entry.pixel.y() - centre.y()) <= radius)) continue;
      found.push_back(entry.index);
    }
  }
}

void FeatureGrid::FindAlong(const Stripe& stripe, std::vector<std::size_t>& found) const {
  const auto cell_of = [](double coordinate, int count) {
    return ClampedInt(coordinate / kGridCell, 0, count - 1);
  };
  Eigen::Vector2d upper = stripe.first;
  Eigen::Vector2d lower = stripe.last;
  if (lower.y() < upper.y()) std::swap(upper, lower);
  const Eigen::Vector2d along = lower - upper;
  const double length = along.norm();
  const Eigen::Vector2d direction = length > 0 ? (along / length).eval() : Eigen::Vector2d(1, 0);
  const double radius = stripe.radius_px;
  const double reach = std::numbers::sqrt2 * radius;  // of its corners from its ends
  // The part of the line at a height from `top` to `bottom`, as shares of its length.
  const auto share_at = [&](double y) {
    return along.y() > 0 ? std::clamp((y - upper.y()) / along.y(), 0.0, 1.0) : 0.0;
  };
  const int last_row = cell_of(lower.y() + reach, num_rows_);
  for (int row = cell_of(upper.y() - reach, num_rows_); row <= last_row; ++row) {
    const double x_top = upper.x() + share_at(row * kGridCell - reach) * along.x();
    const double bottom = (row + 1) * kGridCell + reach;
    const double x_bottom = upper.x() + (along.y() > 0 ? share_at(bottom) : 1.0) * along.x();
    const int first_column = cell_of(std::min(x_top, x_bottom) - reach, num_columns_);
    const int last_column = cell_of(std::max(x_top, x_bottom) + reach, num_columns_);
    const auto first_cell = static_cast<std::size_t>(row * num_columns_ + first_column);
    const std::size_t end =
        first_of_cell_[first_cell + static_cast<std::size_t>(last_column - first_column) + 1];
    for (std::size_t i = first_of_cell_[first_cell]; i < end; ++i) {
      const Entry& entry = entries_[i];
      if (entry.level < stripe.min_level || entry.level > stripe.max_level) continue;
      const Eigen::Vector2d from = entry.pixel.cast<double>() - upper;
      if (std::abs(direction.x() * from.y() - direction.y() * from.x()) > radius) continue;
      const double at = direction.dot(from);
      if (at >= -radius && at <= length + radius) found.push_back(entry.index);
    }
  }
}

template <typename Archive>
void FeatureGrid::ExchangeState(Archive& archive, std::size_t num_features) {
  archive.Number(num_columns_);
  archive.Number(num_rows_);
  archive.List(first_of_cell_, [&](std::size_t& first) { archive.Index(first); });
  archive.List(entries_, [&](Entry& entry) {
    ExchangeElements(archive, entry.pixel);
    archive.Number(entry.level);
    archive.Index(entry.index);
  });
  if constexpr (Archive::kReads) {
    constexpr int kMaxCells = 1 << 15;  // on a side
    const bool is_empty = num_columns_ == 0 && num_rows_ == 0 && first_of_cell_.empty();
    const bool has_cells =
        num_columns_ > 0 && num_rows_ > 0 && num_columns_ <= kMaxCells && num_rows_ <= kMaxCells &&
        first_of_cell_.size() ==
            static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_) + 1 &&
        std::ranges::is_sorted(first_of_cell_) && first_of_cell_.back() == entries_.size();
    const auto is_feature = [&](const Entry& entry) { return entry.index < num_features; };
    if (!(has_cells || (is_empty && entries_.empty())) ||
        !std::ranges::all_of(entries_, is_feature)) {
      archive.Refuse("contradicts itself");
    }
  }
}

template void FeatureGrid::ExchangeState(StateWriter&, std::size_t);
template void FeatureGrid::ExchangeState(StateReader&, std::size_t);

}  // namespace mono3d::tracking
