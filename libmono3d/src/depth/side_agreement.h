// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "depth/sweep_geometry.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// How well the side of the reference that a depth was not chosen by agrees with it: the median,
// over a grid of the pixels of `depth` (CV_32FC1, 0: none) that sources of both sides see, of the
// larger of the two sides' costs (shaders/depth/plane_cost.glsl), 0 to 124. Each plane was chosen
// for the smaller one, so that the larger one is a witness of its own: where images have nothing in
// common it is what unrelated windows have, half their bits, 62, or more. Empty for a handful of
// pixels.
std::optional<int> CostOfWorseSide(const ImageBundle& bundle, const SweepGeometry& geometry,
                                   const cv::Mat& depth);

}  // namespace mono3d
