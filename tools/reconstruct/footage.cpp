// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/footage.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "common/photo_cameras.h"

namespace mono3d::tools {
namespace {

// How the images of the folder go on from one to the next.
Footage FootageOfFolder(const std::string& input, const CameraArguments& camera,
                        const FrameSourceOptions& source) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(input, ignored)) return Footage::kVideo;
  const CameraModel as_taken = CameraAsTaken(input, camera);
  const auto open = [&](int start, int max_frames) {
    FrameSourceOptions part = source;
    part.stride = std::max(1, part.stride);
    part.start += start * part.stride;
    if (max_frames > 0) part.max_frames = max_frames;
    return OpenFrameSource(input, as_taken, part);
  };
  const std::int64_t num_images = open(0, 0)->num_frames().value_or(0);
  return JudgeFootage(num_images, [&](int start) { return open(start, 2); });
}

}  // namespace

CameraModel CameraAsTaken(const std::string& input, const CameraArguments& camera) {
  CameraModel as_taken = FindPrior(input, camera).camera;
  as_taken.distortion = {};
  as_taken.lens = LensModel::kBrown;
  as_taken.shutter = {};
  return as_taken;
}

Footage FootageOf(const std::string& input, const CameraArguments& camera,
                  const FrameSourceOptions& source) {
  if (AreOfSeveralCameras(input)) {
    std::printf(
        "the images are of several cameras, zooms or sizes: they are taken for photographs in any "
        "order (--video: for a video of one camera)\n");
    return Footage::kPhotographs;
  }
  const Footage footage = FootageOfFolder(input, camera, source);
  if (footage == Footage::kPhotographs) {
    std::printf(
        "the images do not go on from one to the next: they are taken for photographs in any "
        "order (--video: for a video)\n");
  } else if (footage == Footage::kSparseVideo) {
    std::printf(
        "neighbouring images share less than 70 %% of what they show: they are placed together "
        "at the end, not tracked from one to the next (--video: tracked)\n");
  }
  return footage;
}

}  // namespace mono3d::tools
