// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/frame_progress.h"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <utility>

#include "mono3d/core/timing.h"

namespace mono3d::tools {
namespace {

constexpr double kTerminalInterval_ms = 100;
constexpr double kPlainInterval_ms = 10'000;

}  // namespace

FrameProgress::FrameProgress(std::string name)
    : name_(std::move(name)),
      is_terminal_(isatty(STDERR_FILENO) != 0),
      start_ms_(WallClockMs()),
      last_ms_(start_ms_) {}

FrameProgress::~FrameProgress() {
  if (is_terminal_ && has_shown_) std::fputs("\n", stderr);
}

void FrameProgress::Show(int num_done, int num_frames) {
  const double now_ms = WallClockMs();
  if (now_ms - last_ms_ < (is_terminal_ ? kTerminalInterval_ms : kPlainInterval_ms)) return;
  last_ms_ = now_ms;
  const double fps = 1e3 * num_done / (now_ms - start_ms_);
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), "%s  image %d/%d  %.2f fps  ETA %.0f s", name_.c_str(),
                num_done, num_frames, fps, (num_frames - num_done) / fps);
  // "\033[K" clears what a longer line left behind.
  std::fprintf(stderr, is_terminal_ ? "\r%s\033[K" : "%s\n", line.data());
  std::fflush(stderr);
  has_shown_ = true;
}

}  // namespace mono3d::tools
