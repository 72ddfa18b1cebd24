// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "mono3d/image/image_bundle.h"

namespace mono3d::tools {

// A bundle and what its reference shows.
struct TrueBundle {
  ImageBundle bundle;
  cv::Mat true_depth;  // CV_32FC1, the poses' unit; 0: none
};

// The depths of every 24th pixel each way of a map, in the place of a tracker's points.
std::vector<float> SparseDepths(const cv::Mat& depth);

// Up to `num_bundles`, spread evenly over the sequence in `folder` (images/, camera.yaml,
// groundtruth.txt, depth/), at its true poses. Their references have a true depth, of which
// SparseDepths stand for the tracker's points. With `step` images from one of a bundle to
// the next; 0: the bundles that the selector chooses among the images with a true depth.
// Throws Error without images, poses for all of them or true depth, and where there is no bundle.
std::vector<TrueBundle> ReadTrueBundles(const std::string& folder, int num_bundles, int step);

}  // namespace mono3d::tools
