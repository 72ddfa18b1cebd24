// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

namespace mono3d {

// A sequence of five frames and a run over it, with known errors, that tests write in no time:
// true depth 10 m everywhere in images of 40x20 pixels, a curved true cloud, a bent way. The run
// has a tenth of the true scale and its poses and model are exact. Its one depth map, of frame 2:
// a tenth of the pixels have none; a quarter of the others are 4 % too far, and these are the least
// confident ones; the normals are 10 degrees off.
struct SmallRun {
  std::filesystem::path sequence;  // folder
  std::filesystem::path run;       // folder
};
inline constexpr double kSmallRunScale = 0.1;

// Writes both below `folder`.
SmallRun WriteSmallRun(const std::filesystem::path& folder);

}  // namespace mono3d
