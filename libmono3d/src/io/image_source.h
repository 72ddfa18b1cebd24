// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mono3d/io/frame_source.h"

namespace mono3d {

// An image as it comes, before resizing and undistortion.
struct SourceImage {
  std::int64_t index = 0;  // before any stride
  double timestamp_s = 0;
  std::string name;
  cv::Mat bgr;  // CV_8UC3
};

class ImageSource {
 public:
  virtual ~ImageSource() = default;

  // See FrameSource.
  virtual std::optional<SourceImage> Next() = 0;
  virtual std::optional<std::int64_t> num_frames() const = 0;
  virtual std::int64_t num_skipped() const = 0;
  virtual std::int64_t num_passed_over() const { return 0; }
};

struct ImageList {
  std::string name;  // for messages: what the user called it
  std::vector<std::string> images;
  std::vector<double> timestamps_s;  // of each image; empty: index / fps
  bool skip_unreadable = true;
};

// The images of a folder, with timestamps.txt where it is there, or of a glob. Throws Error when
// there are none, or the timestamps are no increasing numbers, one for each image.
ImageList FindImages(const std::string& input);

// Throws Error when `options` leave no image. `options` are valid.
std::unique_ptr<ImageSource> OpenImageList(ImageList list, const FrameSourceOptions& options);
std::unique_ptr<ImageSource> OpenVideo(const std::string& path, const FrameSourceOptions& options);

// Brings images to the size asked for (FrameSourceOptions::resize) and takes the distortion out.
// Images of another shape are skipped, or an Error.
std::unique_ptr<FrameSource> PrepareFrames(std::unique_ptr<ImageSource> source,
                                           const CameraModel& camera,
                                           const FrameSourceOptions& options,
                                           bool skips_other_sizes);

// Hands over these frames of a video as they are, up to the first one that cannot be decoded.
void ReadVideoFrames(const std::string& path, const std::set<std::int64_t>& indices,
                     const std::function<void(std::int64_t, const cv::Mat&)>& take);

// By how many degrees programs that show the video turn it clockwise: 0, 90, 180 or 270.
int ReadVideoTurn(const std::string& path);

// "768x448"; nothing when it is anything else.
std::optional<cv::Size> ParseSize(const std::string& text);

// Rate of images that do not tell.
inline constexpr double kDefaultFps = 30;

}  // namespace mono3d
