// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "tracking/features/feature.h"

namespace mono3d::tracking {

// What lies within `radius_px` of the straight line between two pixels, on levels min_level to
// max_level.
struct Stripe {
  Eigen::Vector2d first;
  Eigen::Vector2d last;
  double radius_px = 0;
  int min_level = 0;
  int max_level = 0;
};

// Indices of features by image cell, for windowed search.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  FeatureGrid(const std::vector<Feature>& features, int width, int height);
  // Only those features for whose index `use` holds.
  FeatureGrid(const std::vector<Feature>& features, int width, int height,
              const std::function<bool(std::size_t)>& use);

  std::size_t num_features() const { return entries_.size(); }
  bool IsEmpty() const { return num_rows_ == 0; }
  bool operator==(const FeatureGrid&) const = default;
  // Of a list of `num_features`, for the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive, std::size_t num_features);

  // Appends the features of levels min_level to max_level within `radius_px` (a square) of `pixel`.
  void Find(const Eigen::Vector2d& pixel, double radius_px, int min_level, int max_level,
            std::vector<std::size_t>& found) const;
  // Appends the features of a stripe, row of cells by row of cells.
  void FindAlong(const Stripe& stripe, std::vector<std::size_t>& found) const;

 private:
  struct Entry {
    Eigen::Vector2f pixel;
    int level;
    std::size_t index;

    bool operator==(const Entry&) const = default;
  };
  int num_columns_ = 0;
  int num_rows_ = 0;
  std::vector<std::size_t> first_of_cell_;  // one more than there are cells
  std::vector<Entry> entries_;
};

}  // namespace mono3d::tracking
