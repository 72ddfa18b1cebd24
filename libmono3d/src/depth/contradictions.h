// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>

#include "depth/sweep_geometry.h"

namespace mono3d {

// Pixels whose depth other pixels contradict (CV_8UC1, of the size of `depth`: 255). Where the true
// surface is hidden from the sources or outside their images, and where nothing matches, as in
// leaves that move, matching finds a false one that they do show. But a place in a source shows one
// point: it belongs to the pixel of the reference that has the greatest confidence among those
// whose points fall on it. A pixel is contradicted where every source that sees its point shows
// another there: one whose inverse depth differs by more than `tolerance`.
// `depth` is CV_32FC1, su, 0: no estimate; `confidence` CV_32FC1; both at full resolution.
cv::Mat FindContradicted(const SweepGeometry& geometry, const cv::Mat& depth,
                         const cv::Mat& confidence, double tolerance);

}  // namespace mono3d
