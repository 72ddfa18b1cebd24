// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/features/feature.h"

namespace mono3d::tracking {

// ORB features (Rublee, Rabaud, Konolige, Bradski 2011), spread over the whole image: FAST per cell
// with a second, lower threshold, then suppression by distance on each level.
// `grey` is CV_8UC1. About `num_features` of them, fewer where there is no texture.
// `known` features come first, in their order, where and on the level that they are, with the
// orientation and descriptor of this image; the others keep away from them.
std::vector<Feature> ExtractFeatures(const cv::Mat& grey, const FeatureOptions& options,
                                     int num_features, std::span<const Feature> known = {});

}  // namespace mono3d::tracking
