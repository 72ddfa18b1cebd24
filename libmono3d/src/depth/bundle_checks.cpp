// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/bundle_checks.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "depth/measurement.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A share of the pixels that is next to none, with texture or without.
constexpr double kNearlyNone = 0.01;

std::string SizeText(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

// The largest buffer at full resolution is that of the measurements, four floats a pixel.
std::uint64_t LargestBufferBytes(const CameraModel& camera) {
  const LevelSize size{static_cast<std::uint32_t>(camera.width),
                       static_cast<std::uint32_t>(camera.height)};
  return 4 * sizeof(float) * NumMeasurements(size);
}

void RequireSize(const Frame& frame, const Device& device) {
  const CameraModel& camera = frame.camera;
  if (std::min(camera.width, camera.height) < kMinDepthSide) {
    throw Error(ErrorParts{.what = "image is too small for depth",
                           .where = frame.name,
                           .expected = "at least " + SizeText(kMinDepthSide, kMinDepthSide),
                           .found = SizeText(camera.width, camera.height)});
  }
  const std::uint64_t limit = Limits(device).max_storage_buffer_bytes;
  if (LargestBufferBytes(camera) > limit) {
    throw Error(ErrorParts{.what = "image is too large for depth on " + Info(device).name,
                           .where = frame.name,
                           .expected = "at most " + std::to_string(limit / (4 * sizeof(float))) +
                                       " pixels, as a buffer may have " + std::to_string(limit) +
                                       " bytes",
                           .found = SizeText(camera.width, camera.height),
                           .code = ErrorCode::kUnsupported});
  }
}

// Share of the pixels around which, in the census window, grey values differ.
double TexturedShare(const cv::Mat& grey) {
  cv::Mat differences;
  cv::morphologyEx(grey, differences, cv::MORPH_GRADIENT,
                   cv::getStructuringElement(cv::MORPH_RECT, {9, 7}));
  return double(cv::countNonZero(differences)) / double(differences.total());
}

// Share of the pixels as bright, or as dark, as can be.
double SaturatedShare(const cv::Mat& grey) {
  return double(cv::countNonZero((grey == 0) | (grey == 255))) / double(grey.total());
}

}  // namespace

void RequireBundle(const ImageBundle& bundle, const Device& device) {
  Validate(bundle);
  RequireSize(bundle.reference().frame, device);
}

bool HasEnoughViews(const ImageBundle& bundle, const RefinementOptions& refinement) {
  const auto num_sources = static_cast<int>(bundle.keyframes.size()) - 1;
  return refinement.iterations == 0 || refinement.min_views <= num_sources;
}

std::optional<std::string> ReasonInTheImages(const ImageBundle& bundle) {
  const auto is_blank = [](const Keyframe& keyframe) {
    return TexturedShare(ToGrey(keyframe.frame.bgr)) < kNearlyNone;
  };
  const Keyframe& reference = bundle.reference();
  if (is_blank(reference)) {
    const bool is_saturated = SaturatedShare(ToGrey(reference.frame.bgr)) > 1 - kNearlyNone;
    return is_saturated ? "no texture: the middle image is black or saturated"
                        : "no texture in the middle image";
  }
  const bool others_are_blank = std::all_of(
      bundle.keyframes.begin(), bundle.keyframes.end(),
      [&](const Keyframe& keyframe) { return &keyframe == &reference || is_blank(keyframe); });
  if (others_are_blank) return "no texture in the images around the middle one";
  return std::nullopt;
}

}  // namespace mono3d
