// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace mono3d::synthetic {

using Polyline = std::vector<Eigen::Vector2f>;  // in the horizontal plane, metres

// Distance from the nearest of `lines` on a regular grid over the square of the given half side,
// read back with bilinear interpolation: smooth, and as fast with many lines as with one.
class DistanceField {
 public:
  DistanceField() = default;
  DistanceField(std::span<const Polyline> lines, double half_extent_m);

  float At(const Eigen::Vector2f& p_m) const;  // beyond the square: as on its rim

 private:
  cv::Mat distance_m_;  // CV_32FC1
  float half_extent_m_ = 0;
};

// What lies on the terrain.
struct GroundMap {
  DistanceField streets;  // from the middle of the nearest street
  DistanceField paths;    // from the middle of the nearest gravel path or drive
  std::uint32_t seed = 0;
};

inline constexpr float kStreetHalfWidth_m = 2.8F;
inline constexpr float kPavementWidth_m = 1.3F;
inline constexpr float kPathHalfWidth_m = 1.1F;

}  // namespace mono3d::synthetic
