// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "depth/sweep_geometry.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// Shares of the bits, 0 to 1, in which census windows differ.
struct SideDifferences {
  double before = 0;  // those of the sources before the reference from that of the reference
  double after = 0;
  double across = 0;  // those before from those after
  double worse = 0;   // the larger of `before` and `after`, at each pixel
};

// Means over a grid of the pixels of `depth` (CV_32FC1, 0: none) that sources of both sides see,
// where the depth puts them in the sources. Empty for a handful of pixels.
std::optional<SideDifferences> MeasureSides(const ImageBundle& bundle,
                                            const SweepGeometry& geometry, const cv::Mat& depth);

// Whether the images show different things, so that the depth is what chance found. A plane is
// chosen so that both sides are like the reference: where that is all that they have in common,
// they differ from each other as two things do that differ from a third independently, b + a - 2 b
// a. Where they show the same and differ by noise, each by its own, they differ from each other as
// they do from the reference.
bool AreUnrelated(const SideDifferences& sides);

}  // namespace mono3d
