// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "depth/photometric.params.h"
#include "depth/surface.params.h"
#include "depth/sweep_geometry.h"

namespace mono3d::reference {

// detail.comp: a grey image less the one halved twice, plus 128; CV_8UC1.
cv::Mat Detail(const cv::Mat& grey, const cv::Mat& quarter, double gain);

// photometric.comp: inverse depth before and after the step, its information, and the sources' mean
// weight. `detail` holds the reference and the sources.
std::vector<Eigen::Vector4f> PhotometricStep(const std::vector<cv::Mat>& detail,
                                             const SourceProjections& projections,
                                             const std::vector<float>& inverse_depth,
                                             const PhotometricParams& params);

struct Surface {
  std::vector<float> inverse_depth;
  std::vector<float> confidence;
};

// surface.comp.
Surface FitSurface(const std::vector<Eigen::Vector4f>& measurements,
                   const std::vector<float>& uniqueness, const SurfaceParams& params);

}  // namespace mono3d::reference
