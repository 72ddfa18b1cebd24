// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "depth/inference.params.h"
#include "depth/padded_image.h"
#include "depth/sweep_geometry.h"
#include "reference/depth/median_reference.h"

namespace mono3d::reference {

// Inverse depth, weight, confidence, grey value (data), or inverse depth, confidence, grey value
// (state), of each pixel: shaders/depth/inference.glsl.
using InferenceMap = std::vector<std::array<float, 4>>;

// Matched estimates at half the resolution. `depth` is 0 where the texture filter takes them away,
// `halved` the grey image of half the resolution, `cells` those of 4x4 pixels as
// shaders/depth/inference.glsl has them.
InferenceMap InferenceData(LevelSize size, const std::vector<float>& depth,
                           const FilteredDepth& estimates, const cv::Mat& halved,
                           const InferenceMap& cells);
InferenceMap InferenceHalve(LevelSize size, const InferenceMap& fine);
InferenceMap InferenceExpand(LevelSize coarse_size, LevelSize size, const InferenceMap& coarse,
                             const InferenceMap& data);
InferenceMap InferenceRelax(LevelSize size, float leak, const InferenceMap& data,
                            const InferenceMap& before);
FilteredDepth Inference(const InferenceParams& params, const std::vector<float>& depth,
                        const std::vector<float>& winners, const InferenceMap& state,
                        const cv::Mat& grey, const InferenceMap& cells,
                        const SourceProjections& projections);

}  // namespace mono3d::reference
