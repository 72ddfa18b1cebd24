// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mono3d {

// A subtitle in a video file.
struct VideoSubtitle {
  double begin_s = 0;  // since the beginning of the video
  std::string text;
};

// Does the file begin as MP4 and QuickTime files do?
bool IsMp4(const std::filesystem::path& file);

// Those of the first track of texts of an MP4 or QuickTime file, in their order in the file; empty
// where there is none, or the file is damaged. Nothing is decoded, and only the texts are read.
std::vector<VideoSubtitle> ReadVideoSubtitles(const std::filesystem::path& video);

}  // namespace mono3d
