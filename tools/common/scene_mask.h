// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"

namespace mono3d::tools {

inline constexpr const char* kMaskName = "mask.png";  // among the files of a run

// Where the images do not show the scene.
struct MaskArguments {
  // An image, black where they do not; "none"; or "auto": found out, of recordings that are not
  // played live.
  std::string source = "auto";

  void Visit(OptionVisitor& visit);
};

// For FrameSourceOptions::hidden. Says on stdout what was found, and where it is shown. `camera`:
// of the images as taken. Throws UsageError where a mask that is named is not of the images' shape,
// or the images are of several cameras.
cv::Mat FindHidden(const std::string& input, const MaskArguments& arguments,
                   const CameraModel& camera, const FrameSourceOptions& source, bool is_live,
                   const std::string& shown_in = {});

// mask.png in the folder of a run, as --mask takes it.
void WriteMask(const std::string& folder, const cv::Mat& hidden);

}  // namespace mono3d::tools
