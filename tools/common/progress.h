// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "mono3d/pipeline/pipeline.h"
#include "mono3d/tracking/photo_mapper.h"

namespace mono3d::tools {

// How far a run is: on a terminal one line that renews itself, elsewhere a line every ten seconds.
class ProgressLine {
 public:
  explicit ProgressLine(std::optional<std::int64_t> num_frames = {});
  // Leaves the terminal's line behind, so that what is printed next starts on a line of its own.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Show(const PipelineProgress& progress);
  // `doing`: in front of it, as "learning the camera"; may be empty.
  void Show(const PhotoMapperProgress& progress, const std::string& doing = {});

 private:
  bool IsDue() const;
  void Print(const std::string& text);

  std::optional<std::int64_t> num_frames_;
  bool is_terminal_;
  double start_ms_;
  double last_ms_;
  bool has_shown_ = false;
  PhotoMapperProgress step_;  // of placing photographs, the first one of it
  double step_start_ms_ = 0;
};

// "frame 120/200  14.2 fps  tracking  keyframes 31  maps 9  surfels 512k  ETA 6 s"
std::string FormatProgress(const PipelineProgress& progress, std::optional<std::int64_t> num_frames,
                           double elapsed_s);
// "matched 1200/3504 pairs of images  ETA 30 s", of so much of it in the time
std::string FormatProgress(const PhotoMapperProgress& progress, std::int64_t done_in_time,
                           double elapsed_s);

}  // namespace mono3d::tools
