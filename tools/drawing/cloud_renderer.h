// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "drawing/cloud_view.h"
#include "mono3d/geometry/point_cloud.h"

namespace mono3d::tools {

// A cloud to draw and how.
struct CloudLayer {
  const PointCloud* cloud = nullptr;  // not null
  // One colour for all points (blue, green, red); without it the colours of the cloud, or light
  // grey.
  std::optional<cv::Vec3b> colour = {};
  // One value for each point, shown by colour from 0 to max_value; goes before `colour`.
  std::span<const double> values = {};
  double max_value = 1;
};

// Splats with a z-buffer, as large as the points' radii or, without, as their neighbours are far;
// shaded by the surface that they form. White where nothing is. CV_8UC3, size of the view, no text.
// Throws Error when `values` has another length than the cloud.
cv::Mat RenderClouds(std::span<const CloudLayer> layers, const CloudView& view);

// The colour of a share of the largest error, 0 to 1: light where it is small, dark red where it is
// large. Blue, green, red.
cv::Vec3b ErrorColour(double share);

// A radius for each point with which the points form a surface: the cloud's own, or by the
// distances of the neighbours, at most four times the median so that a point on its own stays
// small.
std::vector<float> SplatRadii(const PointCloud& cloud);

// RenderClouds with the radii of each layer's points.
cv::Mat RenderLayers(std::span<const CloudLayer> layers,
                     std::span<const std::vector<float>> splat_radii, const CloudView& view);

}  // namespace mono3d::tools
