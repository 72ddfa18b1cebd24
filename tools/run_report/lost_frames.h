// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "mono3d/pipeline/reconstruction.h"
#include "run_report/run_notes.h"

namespace mono3d::tools {

// What became of a frame in the end.
enum class FrameFate {
  kTracked,    // when it came
  kRecovered,  // later
  kLost,       // it has no pose
};

struct FrameOutcome {
  std::int64_t frame_index = 0;
  FrameFate fate = FrameFate::kLost;
  std::string reason;      // why it had no pose when it came; of a photograph: why it has none
  std::string photo = {};  // name of the file; empty: of a frame of a video
};

// In the order of the frames.
std::vector<FrameOutcome> FrameOutcomes(const std::vector<FrameNote>& notes,
                                        const Reconstruction& reconstruction);

// Frames without a pose, one after the other; of photographs each stands for itself.
struct LostStretch {
  std::int64_t first_frame = 0;
  std::int64_t last_frame = 0;
  std::int64_t num_frames = 0;
  std::string reason;  // of most of them
  std::string photo = {};
};

// The longest first.
std::vector<LostStretch> LostStretches(const std::vector<FrameOutcome>& outcomes);

}  // namespace mono3d::tools
