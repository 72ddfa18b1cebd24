// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

namespace mono3d::tools {

// How far a sequence is: on a terminal one line that renews itself, elsewhere a line every ten
// seconds.
class FrameProgress {
 public:
  explicit FrameProgress(std::string name);
  // Leaves the terminal's line behind.
  ~FrameProgress();
  FrameProgress(const FrameProgress&) = delete;
  FrameProgress& operator=(const FrameProgress&) = delete;

  void Show(int num_done, int num_frames);

 private:
  std::string name_;
  bool is_terminal_;
  bool has_shown_ = false;
  double last_ms_;  // shown
  double last_call_ms_;
  double mean_ms_ = 0;  // an image
};

}  // namespace mono3d::tools
