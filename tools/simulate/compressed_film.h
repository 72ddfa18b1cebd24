// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>

#include "synthetic/video_options.h"

namespace mono3d::tools {

struct FilmFiles {
  int num_frames = 0;
  std::function<std::filesystem::path(int frame)> raw;      // images that go into the video
  std::function<std::filesystem::path(int frame)> decoded;  // PNG, that come out of it
  std::filesystem::path video;
};

// What the compression cost.
struct FilmQuality {
  double bit_rate_mbit_per_s = 0;  // of the images, without the container
  double psnr_db = 0;              // of the decoded images, all pixels and channels together
};

// Makes a video of images, and images of the video. They are decoded by cv::VideoCapture, as those
// of any video that mono3d reads. Throws Error when a file cannot be read or written.
FilmQuality CompressFilm(const FilmFiles& files, double frames_per_s,
                         const synthetic::VideoOptions& options);

}  // namespace mono3d::tools
