// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "io/live_address.h"

namespace mono3d {

// What came next of a live input.
struct LiveRead {
  enum class Kind {
    kImage,
    kDamaged,  // an image that was not decoded whole
    kEnded,    // the sender says that there are no more
    kBroken,   // nothing more comes by this connection
  };
  Kind kind = Kind::kBroken;
  cv::Mat bgr = {};                    // CV_8UC3; memory of its own
  std::optional<double> stamp_s = {};  // from anywhere on
  std::string reason = {};             // why it ended or broke
};

// One connection to a camera. Used by one thread at a time.
class LiveConnection {
 public:
  virtual ~LiveConnection() = default;

  // Waits for an image, for `timeout_s` at most.
  virtual LiveRead Read(double timeout_s) = 0;
};

// Connects within `timeout_s`; throws Error where that fails. Waits end soon after `*is_cancelled`
// becomes true, which must outlive the connection.
std::unique_ptr<LiveConnection> ConnectToStream(const LiveAddress& address, double timeout_s,
                                                const std::atomic<bool>& is_cancelled);
// A device of Video4Linux; OpenCV waits for its images up to 10 s.
std::unique_ptr<LiveConnection> OpenCameraDevice(const LiveAddress& address);

}  // namespace mono3d
