// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <opencv2/core/version.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <string>
#include <utility>

#include "io/image_source.h"
#include "io/input_advice.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

cv::VideoCapture OpenCapture(const std::string& path) {
  cv::VideoCapture capture;
  // Only FFmpeg: other readers of OpenCV take the name for that of a numbered image sequence.
  if (!MayBeVideo(path) || !capture.open(path, cv::CAP_FFMPEG)) {
    throw Error(ErrorParts{.what = ExplainNoVideo(path),
                           .where = path,
                           .expected = "an image folder, a glob, or a video that FFmpeg can read",
                           .found = {}});
  }
  // Pixels as they are stored, as of photographs: calibrations and shutters are of the sensor.
  capture.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
  return capture;
}

// By how many frames the count of a container may be off. Some store it; of others it is computed
// from the duration.
std::int64_t CountTolerance(const std::filesystem::path& path) {
  return HasStoredFrameCount(path) ? 0 : 1;
}

// Times of the frames, in seconds since the first, each later than the one before.
class FrameTimes {
 public:
  FrameTimes(std::string name, double fps) : name_(std::move(name)), fps_(fps) {}

  // `stamp_s`: what the container says of frame `index`. To be called for each frame in turn.
  double Add(std::int64_t index, double stamp_s) {
    // Matroska rounds to whole milliseconds.
    constexpr double kRounding_s = 0.6e-3;
    if (index == 0) {
      shift_s_ = -stamp_s;
    } else if (!(stamp_s > last_stamp_s_)) {
      if (num_bad_in_turn_++ == 0) first_bad_ = index;
      if (num_bad_in_turn_ > kMaxDelay) TellBadStamp();
      shift_s_ = last_s_ + 1 / fps_ - stamp_s;
    } else {
      if (num_bad_in_turn_ > 0) TellBadStamp();
      num_bad_in_turn_ = 0;
    }
    last_stamp_s_ = stamp_s;
    const double time_s = stamp_s + shift_s_;
    const double at_mean_rate_s = static_cast<double>(index) / fps_;
    const bool is_even = std::abs(time_s - at_mean_rate_s) <= kRounding_s;
    if (is_even && (index == 0 || at_mean_rate_s > last_s_)) return last_s_ = at_mean_rate_s;
    return last_s_ = index == 0 ? time_s : std::max(time_s, std::nextafter(last_s_, kLate_s));
  }

 private:
  static constexpr double kLate_s = std::numeric_limits<double>::infinity();
  // The frames that a decoder still holds at the end of the file (in H.264 and H.265 at most 16)
  // come without a stamp; that is nothing to tell.
  static constexpr int kMaxDelay = 16;

  void TellBadStamp() {
    if (std::exchange(has_told_, true)) return;
    Log(LogLevel::kWarning, name_ + ": the time stamp of frame " + std::to_string(first_bad_) +
                                " is not there, or no later than the one before: such frames "
                                "follow at the mean rate, " +
                                ToText(fps_) + " a second (--fps tells another)");
  }

  std::string name_;
  double fps_;
  double shift_s_ = 0;  // from the container's time
  double last_stamp_s_ = 0;
  double last_s_ = 0;
  std::int64_t first_bad_ = 0;
  int num_bad_in_turn_ = 0;
  bool has_told_ = false;
};

class VideoSource : public ImageSource {
 public:
  VideoSource(const std::string& path, const FrameSourceOptions& options)
      : path_(path), options_(options), capture_(OpenCapture(path)) {
    const double container_fps = capture_.get(cv::CAP_PROP_FPS);
    // Raw streams tell the ticks of a clock in place of a rate.
    const bool has_fps = container_fps > 0 && container_fps <= kMaxFps;
    times_ = FrameTimes(FileName(), has_fps ? container_fps : kDefaultFps);
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (count >= 1 && count < kMaxCount) num_in_file_ = static_cast<std::int64_t>(count);
    if (options_.seeks && options_.start >= kMinSeek) SeekStart();
  }

  std::optional<SourceImage> Next() override {
    if (options_.max_frames > 0 && num_read_ == options_.max_frames) return std::nullopt;
    const std::int64_t wanted = options_.start + num_read_ * options_.stride;
    // Seeking is exact in few containers; frames on the way are passed over one by one.
    for (; num_grabbed_ <= wanted; ++num_grabbed_) {
      if (!capture_.grab()) return AtEnd();
      if (options_.fps > 0) continue;
      time_s_ = times_.Add(num_grabbed_, 1e-3 * capture_.get(cv::CAP_PROP_POS_MSEC));
    }
    SourceImage image{wanted,
                      options_.fps > 0 ? static_cast<double>(wanted) / options_.fps : time_s_,
                      FileName() + "#" + std::to_string(wanted),
                      {}};
    if (!capture_.retrieve(image.bgr) || image.bgr.type() != CV_8UC3) {
      --num_grabbed_;  // its data are there, but no image
      return AtEnd();
    }
    ++num_read_;
    return image;
  }

  std::optional<std::int64_t> num_frames() const override {
    if (!num_in_file_) return std::nullopt;
    const std::int64_t after_start = std::max<std::int64_t>(0, *num_in_file_ - options_.start);
    const std::int64_t with_stride = (after_start + options_.stride - 1) / options_.stride;
    return options_.max_frames > 0 ? std::min<std::int64_t>(with_stride, options_.max_frames)
                                   : with_stride;
  }
  std::int64_t num_skipped() const override { return 0; }

 private:
  static constexpr double kMaxCount = 1e12;  // containers without a count say wild things
  static constexpr double kMaxFps = 1000;
  // Between two places where H.264 and H.265 can be entered lie at most so many frames by default
  // (x264, x265): to reach a nearer one, no more has to be decoded from the beginning.
  static constexpr int kMinSeek = 250;

  // Grabs the first frame. Streams without an index cannot be entered: of those, frames are passed
  // over as ever.
  void SeekStart() {
    if (!capture_.set(cv::CAP_PROP_POS_FRAMES, options_.start) || !capture_.grab()) {
      capture_ = OpenCapture(path_);
      return;
    }
    time_s_ = times_.Add(options_.start, 1e-3 * capture_.get(cv::CAP_PROP_POS_MSEC));
    num_grabbed_ = options_.start + 1;
  }

  std::string FileName() const { return std::filesystem::path(path_).filename().string(); }

  std::optional<SourceImage> AtEnd() {
    if (num_read_ == 0) {
      throw Error(ErrorParts{.what = "no frame is left to read",
                             .where = path_,
                             .expected = "a frame " + std::to_string(options_.start),
                             .found = std::to_string(num_grabbed_) + " frames"});
    }
    if (num_in_file_ && num_grabbed_ + CountTolerance(path_) < *num_in_file_) {
      Log(LogLevel::kWarning, path_ + ": the video ends after " + std::to_string(num_grabbed_) +
                                  " of " + std::to_string(*num_in_file_) + " frames");
    }
    return std::nullopt;
  }

  std::string path_;
  FrameSourceOptions options_;
  cv::VideoCapture capture_;
  FrameTimes times_{{}, kDefaultFps};
  double time_s_ = 0;  // of the frame that was grabbed last
  std::optional<std::int64_t> num_in_file_;
  std::int64_t num_grabbed_ = 0;
  std::int64_t num_read_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> OpenVideo(const std::string& path, const FrameSourceOptions& options) {
  return std::make_unique<VideoSource>(path, options);
}

int ReadVideoTurn(const std::string& path) {
  // Up to version 4.6, OpenCV counts the other way round (and would turn frames the wrong way).
  constexpr int kSign = CV_VERSION_MAJOR * 100 + CV_VERSION_MINOR <= 406 ? -1 : 1;
  const double turn_deg = kSign * OpenCapture(path).get(cv::CAP_PROP_ORIENTATION_META);
  const int quarters = static_cast<int>(std::lround(turn_deg / 90)) % 4;
  return 90 * (quarters < 0 ? quarters + 4 : quarters);
}

void ReadVideoFrames(const std::string& path, const std::set<std::int64_t>& indices,
                     const std::function<void(std::int64_t, const cv::Mat&)>& take) {
  cv::VideoCapture capture = OpenCapture(path);
  std::int64_t num_grabbed = 0;
  cv::Mat bgr;
  for (const std::int64_t index : indices) {
    for (; num_grabbed <= index; ++num_grabbed) {
      if (!capture.grab()) return;
    }
    if (!capture.retrieve(bgr) || bgr.type() != CV_8UC3) return;
    take(index, bgr);
  }
}

}  // namespace mono3d
