// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

namespace mono3d::tools {

// What a camera without calibration leaves: the folder uncalibrated/ of a sequence's folder, with
// images/ and video.mp4, as far as they are there, and timestamps.txt. The files are hard links, or
// copies where the file system has none. No path leads from there to the truth. Replaces a folder
// of an earlier run. Throws Error when it cannot be written.
void LinkUncalibrated(const std::filesystem::path& sequence_folder);

}  // namespace mono3d::tools
