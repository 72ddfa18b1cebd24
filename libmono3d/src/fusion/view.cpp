// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mono3d {
namespace {

double Radians(double degrees) { return degrees * std::numbers::pi / 180; }

}  // namespace

ViewParams MakeViewParams(const DepthMap& map, const SurfelMapOptions& options,
                          std::uint32_t num_surfels, std::uint32_t map_index) {
  ViewParams params{};
  params.width_px = static_cast<std::uint32_t>(map.camera.width);
  params.height_px = static_cast<std::uint32_t>(map.camera.height);
  params.fx = static_cast<float>(map.camera.fx);
  params.fy = static_cast<float>(map.camera.fy);
  params.cx = static_cast<float>(map.camera.cx);
  params.cy = static_cast<float>(map.camera.cy);
  const double pixel_rad = 1 / std::min(map.camera.fx, map.camera.fy);
  // sigma(z) = z^2 * sigma(1/z), so the map's sigma of one pixel is one of inverse depth.
  params.inverse_depth_sigma =
      static_cast<float>(options.association.matching_error_px * map.depth_sigma_per_square_depth);
  // No depth is known better than its pixel is wide: the floor, and all there is when the map does
  // not say how well it knows.
  params.relative_sigma = static_cast<float>(pixel_rad);
  params.association_sigmas = static_cast<float>(options.association.max_sigmas);
  params.free_space_sigmas = static_cast<float>(options.free_space.min_sigmas);
  params.min_normal_cosine =
      static_cast<float>(std::cos(Radians(options.association.max_normal_angle_deg)));
  params.max_slope_per_px = static_cast<float>(std::tan(Radians(kMaxSlantDeg)) * pixel_rad);
  params.num_surfels = num_surfels;
  params.merge_radius_px = 1;
  params.map_index = map_index;
  return params;
}

}  // namespace mono3d
