// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/descriptor.h"

namespace mono3d::tracking {

struct Feature {
  Eigen::Vector2d pixel;  // in the full image
  int level = 0;          // of the pyramid
  double angle_deg = 0;   // of the patch, 0 to 360
  double response = 0;    // FAST score
  double sigma_px = 1;    // standard deviation of `pixel` in x and in y
  Descriptor descriptor{};
};

// The scales of the pyramid's levels and what follows from them.
class PyramidScales {
 public:
  explicit PyramidScales(const FeatureOptions& options);

  int num_levels() const { return static_cast<int>(scales_.size()); }
  double factor() const { return factor_; }
  double Scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }
  // Variance of a key point's position, in px^2 of the full image: one px of its level.
  double Variance(int level) const { return Scale(level) * Scale(level); }
  // The level on which a patch of level 0 seen from `max_distance` shows from `distance`, to the
  // nearest.
  int Nearest(double distance, double max_distance) const;
  // The level at which something shows that shows at level 0 at `max_distance`, seen from
  // `distance`.
  int Predict(double distance, double max_distance) const;

 private:
  double factor_;
  std::vector<double> scales_;
};

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
  };
  int num_columns_ = 0;
  int num_rows_ = 0;
  std::vector<std::size_t> first_of_cell_;  // one more than there are cells
  std::vector<Entry> entries_;
};

// ORB features (Rublee, Rabaud, Konolige, Bradski 2011), spread over the whole image: FAST per cell
// with a second, lower threshold, then suppression by distance on each level.
// `grey` is CV_8UC1. About `num_features` of them, fewer where there is no texture.
// `known` features come first, in their order, where and on the level that they are, with the
// orientation and descriptor of this image; the others keep away from them.
std::vector<Feature> ExtractFeatures(const cv::Mat& grey, const FeatureOptions& options,
                                     int num_features, std::span<const Feature> known = {});

}  // namespace mono3d::tracking
