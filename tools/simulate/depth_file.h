// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "synthetic/sequence.h"

namespace mono3d::tools {

// The form of the true depth of a sequence: the same for all its images.
struct DepthForm {
  bool is_pfm = false;
  double png_scale = 0;  // 16-bit PNG: metres = value / scale; 0 with PFM
};

// `wanted` is "png", "pfm" or "auto". A PNG of 16 bits holds depths up to 65535 / scale and rounds
// by up to 0.5 / scale. The scale is the largest whose range reaches a tenth farther than the
// survey's farthest surface. Where that rounds a fifth nearer than its nearest surface by more than
// 0.01 %, "auto" takes PFM and "png" gives up the far end: what is beyond is written as no depth.
// Throws UsageError on another word.
DepthForm ChooseDepthForm(const std::string& wanted, const synthetic::SequenceSurvey& survey);

// Writes `folder`/scale.txt for PNG; nothing for PFM.
void WriteDepthScale(const std::filesystem::path& folder, const DepthForm& form);

std::filesystem::path DepthPath(const std::filesystem::path& folder, const std::string& frame_name,
                                const DepthForm& form);

// `depth` is CV_32FC1, metres; 0: no depth.
void WriteDepth(const std::filesystem::path& path, const cv::Mat& depth, const DepthForm& form);

}  // namespace mono3d::tools
