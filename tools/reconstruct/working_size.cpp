// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/working_size.h"

#include <algorithm>
#include <cstdio>

namespace mono3d::tools {
namespace {

constexpr int kOfVideo_px = 960;
constexpr int kOfPhotographs_px = 1600;

}  // namespace

void WorkingSize::Visit(OptionVisitor& visit) {
  visit("max_side", max_side_px,
        "images are worked on at most so large, px of the longer side; 0: as they are; auto: 960 "
        "of a video, 1600 of photographs, twice that with --best",
        {{"auto", kAutomatic}});
}

void WorkingSize::Validate() const {
  RequireOption(max_side_px == kAutomatic || max_side_px == 0 || max_side_px >= 64, "max-side",
                "64 or more, 0, or auto", max_side_px);
}

FrameSourceOptions WorkingSize::Limit(FrameSourceOptions source, Footage footage,
                                      const CameraModel& camera) const {
  source.max_side_px = max_side_px;
  if (max_side_px == kAutomatic) {
    source.max_side_px = footage == Footage::kVideo ? kOfVideo_px : kOfPhotographs_px;
    if (is_doubled) source.max_side_px *= 2;
  }
  const int side = std::max(camera.width, camera.height);
  if (source.resize.empty() && source.max_side_px > 0 && side > source.max_side_px) {
    std::printf("images of %dx%d are worked on at %d px of the longer side (--max-side)\n",
                camera.width, camera.height, source.max_side_px);
  }
  return source;
}

}  // namespace mono3d::tools
