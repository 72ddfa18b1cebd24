// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/scene_mask.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <system_error>

#include "common/photo_cameras.h"
#include "common/warnings.h"
#include "mono3d/core/error.h"
#include "mono3d/image/static_parts.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/image_file.h"

namespace mono3d::tools {
namespace {

constexpr std::int64_t kNumImages = 40;
// To be decoded of a video, at most: half a minute of most.
constexpr std::int64_t kMaxVideoImages = 900;

cv::Mat FindStaticOf(const std::string& input, CameraModel camera,
                     const FrameSourceOptions& source) {
  camera.distortion = {};
  camera.lens = LensModel::kBrown;
  camera.shutter = {};
  FrameSourceOptions part = source;
  part.max_side_px = 0;
  part.stride = std::max(1, source.stride);
  std::int64_t num_images =
      OpenFrameSource(input, camera, part)->num_frames().value_or(kMaxVideoImages);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(input, ignored)) {
    num_images = std::min(num_images, kMaxVideoImages);
  }
  part.stride *= static_cast<int>(std::max<std::int64_t>(1, num_images / kNumImages));
  part.max_frames = static_cast<int>(std::min(num_images, kNumImages));
  StaticPartsDetector detector;
  const std::unique_ptr<FrameSource> frames = OpenFrameSource(input, camera, part);
  while (const std::optional<Frame> frame = frames->Next()) detector.Add(frame->bgr);
  return detector.Find();
}

// What is wrong with the images, the run itself says.
cv::Mat FindStatic(const std::string& input, const CameraModel& camera,
                   const FrameSourceOptions& source) {
  const HeldWarnings held;
  try {
    return FindStaticOf(input, camera, source);
  } catch (const Error&) {
    return {};
  }
}

cv::Mat ReadMask(const std::string& file, const CameraModel& camera) {
  if (!std::filesystem::exists(file)) {
    throw UsageError(
        ErrorParts{.what = "there is no such mask",
                   .where = file,
                   .expected = "auto, none, or an image that is black where no scene is",
                   .found = {}});
  }
  const cv::Mat mask = ReadImage(file);
  // To a pixel, as a mask may be of smaller images.
  const double scale = static_cast<double>(camera.width) / mask.cols;
  if (std::abs(scale * mask.rows - camera.height) > std::max(1.0, scale)) {
    throw UsageError(
        ErrorParts{.what = "the mask has another shape than the images",
                   .where = file,
                   .expected = std::to_string(camera.width) + "x" + std::to_string(camera.height),
                   .found = std::to_string(mask.cols) + "x" + std::to_string(mask.rows)});
  }
  cv::Mat grey;
  cv::cvtColor(mask, grey, cv::COLOR_BGR2GRAY);
  return grey == 0;
}

double Percent(const cv::Mat& hidden) {
  return 100.0 * cv::countNonZero(hidden) / static_cast<double>(hidden.total());
}

}  // namespace

void MaskArguments::Visit(OptionVisitor& visit) {
  visit("mask", source,
        "image that is black where the images do not show the scene: text, a bonnet, what is "
        "behind a turntable; auto: what stays at its place in all images of a recording is found "
        "out; none");
}

cv::Mat FindHidden(const std::string& input, const MaskArguments& arguments,
                   const CameraModel& camera, const FrameSourceOptions& source, bool is_live,
                   const std::string& shown_in) {
  if (arguments.source == "none") return {};
  const bool is_auto = arguments.source == "auto";
  if (is_auto && is_live) return {};
  std::error_code ignored;
  if (!is_live && std::filesystem::is_directory(input, ignored) && AreOfSeveralCameras(input)) {
    if (is_auto) return {};
    throw UsageError("--mask is for images of one camera and one size");
  }
  if (!is_auto) return ReadMask(arguments.source, camera);
  const cv::Mat hidden = FindStatic(input, camera, source);
  if (!hidden.empty()) {
    std::printf(
        "%.1f %% of the images stays at its place, such as text, a part of the vehicle or what is "
        "behind a turntable: it is not taken for the scene (%s--mask none: it is)\n",
        Percent(hidden), shown_in.empty() ? "" : (shown_in + "; ").c_str());
  }
  return hidden;
}

void WriteMask(const std::string& folder, const cv::Mat& hidden) {
  WritePng(std::filesystem::path(folder) / kMaskName, hidden == 0);
}

}  // namespace mono3d::tools
