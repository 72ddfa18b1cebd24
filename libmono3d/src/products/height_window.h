// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "mono3d/products/orthophoto.h"

namespace mono3d {

// A part of a surface model in memory. Any number of threads may ask.
class HeightWindow {
 public:
  // The part of the model around `part` of the map, by `margin` units of the map.
  HeightWindow(const HeightSource& source, const Eigen::AlignedBox2d& part, double margin);

  bool IsEmpty() const { return highest_ == kNoHeight; }
  float lowest() const { return lowest_; }
  float highest() const { return highest_; }

  // Between the cells around; kNoHeight where one of them is that is not far from the place.
  float At(const Eigen::Vector2d& place) const;
  // Does the surface lie between the place, which is on it, and the eye?
  bool IsHidden(const Eigen::Vector3d& place, const Eigen::Vector3d& eye) const;

 private:
  void FindBlockHeights();

  RasterGrid grid_;      // of the window
  double height_units_;  // units of height per cell
  cv::Mat heights_;
  cv::Mat highest_of_blocks_;
  float lowest_ = kNoHeight;
  float highest_ = kNoHeight;
};

}  // namespace mono3d
