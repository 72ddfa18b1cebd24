// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "synthetic/sequence.h"
#include "synthetic/video_options.h"

namespace mono3d::synthetic {

// One sequence of a suite. Its name says what it is: suite, number, scene, flight, hard feature.
struct SuiteSequence {
  std::string name;
  SequenceOptions options;
  int jpeg_quality = 0;  // 0: not compressed
  VideoOptions video;
  bool uncalibrated = false;  // the pictures once more, in a folder without calibration
};

}  // namespace mono3d::synthetic
