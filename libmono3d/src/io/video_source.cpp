// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <opencv2/videoio.hpp>
#include <set>

#include "io/image_source.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

cv::VideoCapture OpenCapture(const std::string& path) {
  cv::VideoCapture capture;
  // Only FFmpeg: other readers of OpenCV take the name for that of a numbered image sequence.
  if (!capture.open(path, cv::CAP_FFMPEG)) {
    throw Error(ErrorParts{.what = "cannot open the video",
                           .where = path,
                           .expected = "an image folder, a glob, or a video that FFmpeg can read",
                           .found = {}});
  }
  return capture;
}

class VideoSource : public ImageSource {
 public:
  VideoSource(const std::string& path, const FrameSourceOptions& options)
      : path_(path), options_(options), capture_(OpenCapture(path)) {
    const double container_fps = capture_.get(cv::CAP_PROP_FPS);
    const bool has_fps = std::isfinite(container_fps) && container_fps > 0;
    fps_ = options.fps > 0 ? options.fps : has_fps ? container_fps : kDefaultFps;
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (count >= 1 && count < kMaxCount) num_in_file_ = static_cast<std::int64_t>(count);
  }

  std::optional<SourceImage> Next() override {
    if (options_.max_frames > 0 && num_read_ == options_.max_frames) return std::nullopt;
    const std::int64_t wanted = options_.start + num_read_ * options_.stride;
    // Seeking is exact in few containers; frames on the way are passed over one by one.
    for (; num_grabbed_ <= wanted; ++num_grabbed_) {
      if (!capture_.grab()) return AtEnd();
    }
    SourceImage image{
        wanted,
        static_cast<double>(wanted) / fps_,
        std::filesystem::path(path_).filename().string() + "#" + std::to_string(wanted),
        {}};
    if (!capture_.retrieve(image.bgr) || image.bgr.type() != CV_8UC3) return AtEnd();
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

  std::optional<SourceImage> AtEnd() {
    if (num_read_ == 0) {
      throw Error(ErrorParts{.what = "no frame is left to read",
                             .where = path_,
                             .expected = "a frame " + std::to_string(options_.start),
                             .found = std::to_string(num_grabbed_) + " frames"});
    }
    // The count is computed from the duration and may be off by one.
    if (num_in_file_ && num_grabbed_ + 1 < *num_in_file_) {
      Log(LogLevel::kWarning, path_ + ": the video ends after " + std::to_string(num_grabbed_) +
                                  " of " + std::to_string(*num_in_file_) + " frames");
    }
    return std::nullopt;
  }

  std::string path_;
  FrameSourceOptions options_;
  cv::VideoCapture capture_;
  double fps_ = kDefaultFps;
  std::optional<std::int64_t> num_in_file_;
  std::int64_t num_grabbed_ = 0;
  std::int64_t num_read_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> OpenVideo(const std::string& path, const FrameSourceOptions& options) {
  return std::make_unique<VideoSource>(path, options);
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
