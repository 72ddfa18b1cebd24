// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace mono3d::synthetic {

using Polyline = std::vector<Eigen::Vector2f>;  // in the horizontal plane, metres

// Numbers on a regular grid over the square of the given half side around the origin, read back
// with bilinear interpolation. Beyond the square: as on its rim; 1000 where there is no grid.
class Grid {
 public:
  Grid() = default;
  Grid(double half_extent_m, float cell_m, const std::function<float(const Eigen::Vector2f&)>& at);

  float At(const Eigen::Vector2f& p_m) const;
  bool IsEmpty() const { return values_.empty(); }

 protected:
  cv::Mat values_;  // CV_32FC1
  float half_extent_m_ = 0;
  float cell_m_ = 1;
};

// Distance from the nearest of `lines`, exact up to `reach_m` and never more: smooth, and as fast
// with many lines as with one.
class DistanceField : public Grid {
 public:
  DistanceField() = default;
  DistanceField(std::span<const Polyline> lines, double half_extent_m, float reach_m = 60);

 private:
  void Lower(const Eigen::Vector2f& a, const Eigen::Vector2f& b, float reach_m);
};

// What lies on the terrain.
struct GroundMap {
  DistanceField streets;  // from the middle of the nearest street
  DistanceField paths;    // from the middle of the nearest gravel path or drive
  DistanceField water;    // from the middle line of the river or pond; empty: none
  float water_half_width_m = 0;
  float water_level_m = 0;
  float lawn_radius_m = 0;  // no fields this close to the origin
  Grid heights;             // of the terrain, metres
  std::uint32_t seed = 0;
};

// Whether a place is in the water or nearer to it than this.
bool IsAtWater(const GroundMap& ground, const Eigen::Vector2f& p_m, float within_m);

inline constexpr float kStreetHalfWidth_m = 2.8F;
inline constexpr float kPavementWidth_m = 1.3F;
inline constexpr float kPathHalfWidth_m = 1.1F;

}  // namespace mono3d::synthetic
