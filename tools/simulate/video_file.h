// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "synthetic/video_options.h"

namespace mono3d::tools {

struct VideoFormat {
  cv::Size size;  // even
  double frames_per_s = 30;
  synthetic::VideoOptions options;
};

// Writes an MP4 file by an encoder of FFmpeg's libraries. cv::VideoWriter, which calls the same
// ones, has no means of setting a bit rate. One thread: the same images give the same bytes.
class VideoFile {
 public:
  // Throws Error when the file cannot be created or this machine has no such encoder.
  VideoFile(const std::filesystem::path& path, const VideoFormat& format);
  ~VideoFile();  // an unfinished file stays
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // `bgr` is CV_8UC3 of the size of the format. Images follow each other at the frame rate.
  void Add(const cv::Mat& bgr);

  // Writes what is left and closes the file. Returns the bits of all images, without those of the
  // container.
  std::int64_t Finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d::tools
