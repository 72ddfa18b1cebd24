// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/image/image_bundle.h"

namespace mono3d {

// The images of a bundle, CV_8UC1.
struct GreyImages {
  cv::Mat reference;
  std::vector<cv::Mat> sources;  // as IndicesOfSources; empty where there is none
};

GreyImages GreyImagesOf(const ImageBundle& bundle);

}  // namespace mono3d
