// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "depth/prior.params.h"
#include "reference/depth/fine_sgm_reference.h"

namespace mono3d::reference {

// The planes of each pixel of a level and the jumps of its surface, from the coarser level
// (prior.comp).
std::vector<FineRange> Prior(const std::vector<float>& coarse_depth,
                             const std::vector<Eigen::Vector3f>& coarse_normals,
                             const cv::Mat& grey, const PriorParams& params);

}  // namespace mono3d::reference
