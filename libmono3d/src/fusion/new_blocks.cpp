// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/new_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/surfel.h"

namespace mono3d {
namespace {

constexpr double kReviewMargin_px = 1;

// Signed distance of a point from a plane through the camera, on whose inner side both coordinates
// weigh positive; as in shaders/fusion/cull_blocks.comp.
double InsidePlane(double across, double z, double across_weight, double z_weight) {
  return (across_weight * across + z_weight * z) / std::hypot(across_weight, z_weight);
}

double InsidePyramid(const ViewParams& view, const Eigen::Vector3d& p) {
  constexpr double kBeyond = 0.5 + kReviewMargin_px;  // from the outermost pixel centres
  const double left = InsidePlane(p.x(), p.z(), view.fx, view.cx + kBeyond);
  const double right = InsidePlane(p.x(), p.z(), -view.fx, view.width_px - 1 + kBeyond - view.cx);
  const double top = InsidePlane(p.y(), p.z(), view.fy, view.cy + kBeyond);
  const double bottom = InsidePlane(p.y(), p.z(), -view.fy, view.height_px - 1 + kBeyond - view.cy);
  return std::min({left, right, top, bottom, p.z()});
}

}  // namespace

std::vector<BlockSphere> SpheresOfNew(const ViewParams& view, std::span<const std::uint32_t> pixels,
                                      std::span<const float> depth) {
  std::vector<BlockSphere> spheres;
  for (std::size_t first = 0; first < pixels.size(); first += kSurfelsPerBlock) {
    Eigen::Array3d least = Eigen::Array3d::Constant(std::numeric_limits<double>::max());
    Eigen::Array3d most = -least;
    const std::size_t count = std::min<std::size_t>(kSurfelsPerBlock, pixels.size() - first);
    for (const std::uint32_t pixel : pixels.subspan(first, count)) {
      const double z = depth[pixel];
      const double column = pixel % view.width_px;
      const double row = pixel / view.width_px;
      const Eigen::Array3d p(z * (column - view.cx) / view.fx, z * (row - view.cy) / view.fy, z);
      least = least.min(p);
      most = most.max(p);
    }
    // A little more, for surfels in single precision.
    spheres.push_back({0.5 * (least + most), 0.501 * (most - least).matrix().norm()});
  }
  return spheres;
}

std::vector<std::uint32_t> SpheresInView(std::span<const BlockSphere> spheres,
                                         const ViewParams& view, const Similarity& S_view_anchor) {
  std::vector<std::uint32_t> in_view;
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const double reach = S_view_anchor.scale() * spheres[i].radius;
    if (InsidePyramid(view, S_view_anchor * spheres[i].centre) < -reach) continue;
    in_view.push_back(static_cast<std::uint32_t>(i));
  }
  return in_view;
}

}  // namespace mono3d
