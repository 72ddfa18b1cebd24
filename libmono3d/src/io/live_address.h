// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

namespace mono3d {

enum class LiveKind { kRtsp, kMpegTs, kDevice };

// Where images come from now.
struct LiveAddress {
  LiveKind kind = LiveKind::kRtsp;
  std::string url;    // as it was given, with what it may hold of a password
  std::string shown;  // WithoutPassword: for messages and files
  std::string name;   // a word for the names of frames: "live" or "video0"
};

// Throws UsageError where `input` is no address of a live input, or has no host or port.
LiveAddress ParseLiveAddress(const std::string& input);

}  // namespace mono3d
