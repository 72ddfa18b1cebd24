// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "mono3d/evaluation/cloud_picture.h"

namespace mono3d {

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

}  // namespace mono3d
