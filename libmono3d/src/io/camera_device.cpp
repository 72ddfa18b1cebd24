// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <filesystem>
#include <opencv2/videoio.hpp>
#include <system_error>

#include "io/live_connection.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

class CameraDevice : public LiveConnection {
 public:
  explicit CameraDevice(const LiveAddress& address) {
    std::error_code ignored;
    if (!std::filesystem::exists(address.url, ignored)) {
      throw Error(ErrorParts{.what = "there is no such camera: plug it in, and see ls /dev/video*",
                             .where = address.shown,
                             .expected = "a device of Video4Linux",
                             .found = {},
                             .code = ErrorCode::kNotFound});
    }
    if (!std::filesystem::is_character_file(address.url, ignored) ||
        !capture_.open(address.url, cv::CAP_V4L2)) {
      throw Error(
          ErrorParts{.what = "the camera cannot be opened: see that no other program uses it, and "
                             "that you may read it (group video)",
                     .where = address.shown,
                     .expected = "a device of Video4Linux that takes images",
                     .found = {},
                     .code = ErrorCode::kIo});
    }
  }

  LiveRead Read(double /*timeout_s*/) override {
    LiveRead read;
    if (!capture_.grab()) {
      read.reason = "the camera gives no more images";
      return read;
    }
    // When the driver took the image, by the monotonic clock; 0 from some drivers.
    const double stamp_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
    if (stamp_ms > 0) read.stamp_s = 1e-3 * stamp_ms;
    const bool is_whole = capture_.retrieve(read.bgr) && read.bgr.type() == CV_8UC3;
    read.kind = is_whole ? LiveRead::Kind::kImage : LiveRead::Kind::kDamaged;
    return read;
  }

 private:
  cv::VideoCapture capture_;
};

}  // namespace

std::unique_ptr<LiveConnection> OpenCameraDevice(const LiveAddress& address) {
  return std::make_unique<CameraDevice>(address);
}

}  // namespace mono3d
