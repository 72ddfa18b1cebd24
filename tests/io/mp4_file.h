// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace mono3d {

// Changes an MP4 file with one track whose index follows its frames (ISO/IEC 14496-12).
// One duration for each frame, in ticks of the track's clock; their sum is that of before.
void SetFrameDurations(const std::filesystem::path& mp4, const std::vector<std::uint32_t>& ticks);
// Ticks that the frames have in all.
std::uint32_t TotalDuration(const std::filesystem::path& mp4);
// What shows the video is to turn it clockwise by 90 degrees.
void SetQuarterTurn(const std::filesystem::path& mp4);

}  // namespace mono3d
