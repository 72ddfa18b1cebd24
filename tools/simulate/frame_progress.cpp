// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/frame_progress.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "mono3d/core/timing.h"

namespace mono3d::tools {
namespace {

constexpr double kTerminalInterval_ms = 100;
constexpr double kPlainInterval_ms = 10'000;
constexpr double kNewShare = 0.1;  // of the newest image in the mean time

}  // namespace

FrameProgress::FrameProgress(std::string name)
    : name_(std::move(name)),
      is_terminal_(isatty(STDERR_FILENO) != 0),
      last_ms_(WallClockMs()),
      last_call_ms_(last_ms_) {}

FrameProgress::~FrameProgress() {
  if (is_terminal_ && has_shown_) std::fputs("\n", stderr);
}

void FrameProgress::Show(int num_done, int num_frames) {
  const double now_ms = WallClockMs();
  // Before the first image the scene was built, and images of an earlier run cost no time.
  const double per_image_ms = now_ms - last_call_ms_;
  last_call_ms_ = now_ms;
  mean_ms_ = num_done <= 2 ? per_image_ms : mean_ms_ + kNewShare * (per_image_ms - mean_ms_);
  if (now_ms - last_ms_ < (is_terminal_ ? kTerminalInterval_ms : kPlainInterval_ms)) return;
  last_ms_ = now_ms;
  const double fps = 1e3 / std::max(mean_ms_, 0.01);
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), "%s  image %d/%d  %.2f fps  ETA %.0f s", name_.c_str(),
                num_done, num_frames, fps, (num_frames - num_done) / fps);
  // "\033[K" clears what a longer line left behind.
  std::fprintf(stderr, is_terminal_ ? "\r%s\033[K" : "%s\n", line.data());
  std::fflush(stderr);
  has_shown_ = true;
}

}  // namespace mono3d::tools
