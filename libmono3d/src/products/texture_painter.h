// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "mono3d/geometry/triangle_mesh.h"
#include "products/chart_atlas.h"
#include "products/triangle_views.h"
#include "products/view_shares.h"

namespace mono3d {

// What a mesh is painted with.
struct Paint {
  const TriangleMesh& mesh;
  const TriangleViews& views;
  const std::vector<std::uint32_t>& chosen;  // view of each triangle
  const ViewShares& shares;
  const ChartAtlas& atlas;
  std::span<const PinholeView> cameras;
  std::span<const Eigen::Vector3f> gains;
  // Image of a view, free of distortion; empty where it cannot be read any more.
  std::function<cv::Mat(std::uint32_t view)> read;
};

// One of the textures, CV_8UC3: every texel is where the surface has it looked up in the views that
// have a share there, bilinear between pixels. Texels beside the charts repeat their borders. Reads
// the images of the texture's views one after the other.
cv::Mat PaintTexture(const Paint& paint, std::uint32_t texture);

}  // namespace mono3d
