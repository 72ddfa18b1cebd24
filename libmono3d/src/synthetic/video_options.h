// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

#include "mono3d/core/options.h"

namespace mono3d::synthetic {

inline constexpr std::array<const char*, 3> kVideoCodecs = {"none", "h264", "h265"};
inline constexpr std::array<const char*, 3> kVideoOutputs = {"images", "video", "both"};

// How a camera compresses what it films.
struct VideoOptions {
  std::string codec = "none";  // one of kVideoCodecs; none: each image for itself
  double bit_rate_mbit_per_s = 4;
  int keyframe_interval = 30;  // images from one that needs no other to the next
  int b_frames = 2;            // images in a row that are predicted from both sides, at most
  std::string keep = "both";   // one of kVideoOutputs; images: those decoded from the stream

  bool IsOn() const { return codec != "none"; }
  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

}  // namespace mono3d::synthetic
