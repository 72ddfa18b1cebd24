// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/products/finished_run.h"

namespace MONO3D_EXPORT mono3d {

// The image as it was taken, CV_8UC3 (BGR). Throws Error where it cannot be decoded or is of
// another size than its camera.
cv::Mat ReadRunImage(const RunImage& image);

// The keyframes whose image is there. Throws Error where there is none; `product` names what they
// are for.
std::vector<RunImage> ImagesThatAreThere(const FinishedRun& run, const std::string& product);

}  // namespace mono3d
