// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/frame_source.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "image/hidden_parts.h"
#include "io/image_list.h"
#include "io/image_source.h"
#include "io/motion_stride.h"
#include "io/read_ahead_source.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/image/undistorter.h"

namespace mono3d {
namespace {

constexpr const char* kToCalibration = "calibration";

std::string SizeText(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

std::optional<cv::Size> ParseSize(const std::string& text) {
  constexpr std::int64_t kMax = 32767;  // what cv::remap can address
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos) return std::nullopt;
  const std::optional<std::int64_t> width = ParseInteger(text.substr(0, cross));
  const std::optional<std::int64_t> height = ParseInteger(text.substr(cross + 1));
  const auto fits = [](std::optional<std::int64_t> size) {
    return size && *size >= 1 && *size <= kMax;
  };
  if (!fits(width) || !fits(height)) return std::nullopt;
  return cv::Size(static_cast<int>(*width), static_cast<int>(*height));
}

namespace {

// The calibration holds for images of the same field of view: rounding a size to whole pixels is
// the only difference in shape that resizing brings about; anything more was cropped.
bool HaveSameShape(cv::Size size, const CameraModel& calibration) {
  const double scale_x = static_cast<double>(size.width) / calibration.width;
  const double scale_y = static_cast<double>(size.height) / calibration.height;
  return std::abs(scale_x * calibration.height - size.height) < 1 ||
         std::abs(scale_y * calibration.width - size.width) < 1;
}

CameraModel CameraOfImages(const CameraModel& calibration, const FrameSourceOptions& options) {
  Validate(calibration, "frame source");
  const std::optional<cv::Size> size = ParseSize(options.resize);
  if (size) return calibration.Resized(size->width, size->height);
  const int side = std::max(calibration.width, calibration.height);
  if (!options.resize.empty() || options.max_side_px == 0 || side <= options.max_side_px) {
    return calibration;
  }
  const double scale = static_cast<double>(options.max_side_px) / side;
  const auto scaled = [&](int length) {
    return std::max(1, static_cast<int>(std::lround(scale * length)));
  };
  return calibration.Resized(scaled(calibration.width), scaled(calibration.height));
}

// Brings images to the size asked for and takes the distortion out.
class PreparedFrames : public FrameSource {
 public:
  PreparedFrames(std::unique_ptr<ImageSource> source, const CameraModel& calibration,
                 const FrameSourceOptions& options, bool skips_other_sizes)
      : source_(std::move(source)),
        calibration_(calibration),
        skips_other_sizes_(skips_other_sizes),
        is_resizing_(!options.resize.empty()),
        on_image_(options.on_image),
        undistorter_(CameraOfImages(calibration, options)) {
    if (!calibration.shutter.IsGlobal()) sensor_ = CameraOfImages(calibration, options);
    if (!options.hidden.empty()) {
      const cv::Mat hidden = AtSizeOfImages(options.hidden);
      hidden_ = HiddenParts(hidden);
      undistorted_hidden_ = undistorter_.Undistort(hidden != 0) != 0;
    }
  }

  std::optional<Frame> Next() override {
    while (std::optional<SourceImage> image = source_->Next()) {
      if (!Fits(image->bgr.size())) {
        Skip(*image);
        continue;
      }
      NoteFitting();
      if (on_image_) on_image_(image->index, image->bgr);
      return Frame{image->index, image->timestamp_s,
                   image->name,  undistorter_.Undistort(hidden_.Fill(Resize(image->bgr))),
                   camera(),     sensor_};
    }
    if (first_other_size_ && !has_fitting_) throw Error(*first_other_size_);
    return std::nullopt;
  }

  std::optional<std::int64_t> num_frames() const override { return source_->num_frames(); }
  std::int64_t num_skipped() const override { return source_->num_skipped() + num_of_other_sizes_; }
  std::int64_t num_passed_over() const override { return source_->num_passed_over(); }
  const CameraModel& camera() const override { return undistorter_.camera(); }
  cv::Mat hidden() const override { return undistorted_hidden_; }

 private:
  bool Fits(cv::Size size) const {
    if (is_resizing_) return HaveSameShape(size, calibration_);
    return size.width == calibration_.width && size.height == calibration_.height;
  }

  void NoteFitting() {
    has_fitting_ = true;
    for (const std::string& skipped : skipped_at_start_) Log(LogLevel::kWarning, skipped);
    skipped_at_start_.clear();
  }

  // Throws where it was asked for by name, or the calibration is that of no image.
  void Skip(const SourceImage& image) {
    constexpr int kMaxAtStart = 10;
    const bool is_turned = HaveSameShape(cv::Size(image.bgr.rows, image.bgr.cols), calibration_) &&
                           calibration_.width != calibration_.height;
    const Error error(ErrorParts{
        .what = is_turned
                    ? "the calibration is of images that were turned, and pixels are taken as "
                      "they are stored: leave out --camera, or calibrate with "
                      "mono3d-calibrate from files as the camera wrote them"
                : is_resizing_ ? "image has another shape than the calibration"
                               : "image has another size than the calibration; see --resize, or "
                                 "--photos for those of several cameras",
        .where = image.name,
        .expected = SizeText(calibration_.width, calibration_.height),
        .found = SizeText(image.bgr.cols, image.bgr.rows)});
    if (!first_other_size_) first_other_size_ = error;
    ++num_of_other_sizes_;
    if (!skips_other_sizes_ || (!has_fitting_ && num_of_other_sizes_ >= kMaxAtStart)) {
      throw Error(*first_other_size_);
    }
    skipped_at_start_.push_back(std::string("skipped: ") + error.what());
    if (has_fitting_) NoteFitting();
  }

  // Pixels of which a part is hidden are hidden.
  cv::Mat AtSizeOfImages(const cv::Mat& mask) const {
    if (mask.type() != CV_8UC1 || !HaveSameShape(mask.size(), calibration_)) {
      throw Error(ErrorParts{.what = "the mask has another shape than the images",
                             .where = "frame source",
                             .expected = SizeText(calibration_.width, calibration_.height),
                             .found = SizeText(mask.cols, mask.rows)});
    }
    cv::Mat hidden;
    cv::resize(mask != 0, hidden, {camera().width, camera().height}, 0, 0, cv::INTER_AREA);
    return hidden;
  }

  cv::Mat Resize(const cv::Mat& bgr) const {
    const cv::Size target(camera().width, camera().height);
    if (bgr.size() == target) return bgr;
    cv::Mat resized;
    // Averaging over areas keeps a smaller image free of aliasing.
    const bool shrinks = target.width < bgr.cols;
    cv::resize(bgr, resized, target, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_CUBIC);
    return resized;
  }

  std::unique_ptr<ImageSource> source_;
  CameraModel calibration_;
  bool skips_other_sizes_;
  bool has_fitting_ = false;  // an image of the calibration's size was there
  std::int64_t num_of_other_sizes_ = 0;
  std::optional<Error> first_other_size_;
  std::vector<std::string> skipped_at_start_;  // told when an image fits: else there is one error
  bool is_resizing_;
  std::function<void(std::int64_t, const cv::Mat&)> on_image_;
  Undistorter undistorter_;
  HiddenParts hidden_;
  cv::Mat undistorted_hidden_;
  CameraModel sensor_;  // where it has a rolling shutter
};

std::unique_ptr<ImageSource> OpenImages(const std::string& input,
                                        const FrameSourceOptions& options) {
  if (options.stride == kStrideByMotion) {
    FrameSourceOptions all = options;
    all.stride = 1;
    all.max_frames = 0;
    return StrideByMotion(OpenImages(input, all), options.max_frames);
  }
  switch (KindOfInput(input)) {
    case InputKind::kImages:
      return OpenImageList(FindImages(input), options);
    case InputKind::kImage:
      return OpenImageList({input, {input}, {}, true}, options);
    case InputKind::kVideo:
      break;
  }
  return OpenVideo(input, options);
}

}  // namespace

std::unique_ptr<FrameSource> PrepareFrames(std::unique_ptr<ImageSource> source,
                                           const CameraModel& camera,
                                           const FrameSourceOptions& options,
                                           bool skips_other_sizes) {
  return std::make_unique<PreparedFrames>(std::move(source), camera, options, skips_other_sizes);
}

void FrameSourceOptions::Visit(OptionVisitor& visit) {
  visit("fps", fps, "images a second; 0: the video's own, timestamps.txt, or 30");
  visit("stride", stride,
        "take every n-th image; auto: those that the motion of the camera calls for, whatever the "
        "rate",
        {{"auto", kStrideByMotion}});
  visit("start", start, "first image to take");
  visit("max_frames", max_frames, "number of images to take at most; 0: all");
  visit("resize", resize,
        "WIDTHxHEIGHT: resize images and calibration; \"calibration\": resize images to the size "
        "of the calibration");
}

void FrameSourceOptions::Validate() const {
  RequireOption(std::isfinite(fps) && fps >= 0, "fps", "0 or more", fps);
  RequireOption(stride >= 1 || stride == kStrideByMotion, "stride", "1 or more, or auto", stride);
  RequireOption(start >= 0, "start", "0 or more", start);
  RequireOption(max_frames >= 0, "max-frames", "0 or more", max_frames);
  RequireOption(max_side_px >= 0, "max-side", "0 or more", max_side_px);
  if (resize.empty() || resize == kToCalibration || ParseSize(resize)) return;
  throw UsageError(ErrorParts{.what = "bad size",
                              .where = "--resize",
                              .expected = "WIDTHxHEIGHT or calibration",
                              .found = resize});
}

std::unique_ptr<FrameSource> OpenFrameSource(const std::string& input, const CameraModel& camera,
                                             const FrameSourceOptions& options) {
  options.Validate();
  const InputKind kind = KindOfInput(input);
  std::unique_ptr<FrameSource> frames =
      PrepareFrames(OpenImages(input, options), camera, options, kind == InputKind::kImages);
  if (kind != InputKind::kVideo) return frames;
  // Decoding a video costs as much as tracking it.
  return ReadAhead(std::move(frames));
}

std::unique_ptr<FrameSource> OpenFrameSource(const std::vector<std::string>& images,
                                             const CameraModel& camera,
                                             const FrameSourceOptions& options) {
  options.Validate();
  return PrepareFrames(OpenImageList({"images", images, {}, false}, options), camera, options,
                       /*skips_other_sizes=*/false);
}

}  // namespace mono3d
