// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/clamped_int.h"
#include "image/image_noise.h"

namespace mono3d::tracking {
namespace {

// Half of the usual one: walls in the shade have corners too, and the best are kept of too many.
// OpenCV's unit: a third of 255 grey levels.
constexpr double kSiftContrast = 0.02;
// An image that uses fewer grey levels than half of those that there are is taken as too dark, or
// as hazy: its structures have less contrast by as much.
constexpr double kUsualRange = 128;
// White noise of one grey level has an extremum of more than this, 0.34 grey levels, at one of some
// 10^5 pixels.
constexpr double kContrastOfNoise = 0.004;
// OpenCV's SIFT looks for features in the doubled image, and does not take into account that pixel
// x of it is at x / 2 - 1 / 4.
constexpr double kSiftShift_px = 0.25;
// Of the finest features; of larger ones it grows with their size (diameter in px).
constexpr double kFinestSigma_px = 0.5;
constexpr double kFinestSize_px = 4;

cv::Mat ShrunkGrey(const cv::Mat& bgr, int max_side_px) {
  const cv::Mat grey = ToGrey(bgr);
  const int side = std::max(grey.cols, grey.rows);
  if (side <= max_side_px) return grey;
  const double scale = static_cast<double>(max_side_px) / side;
  cv::Mat small;
  cv::resize(grey, small,
             cv::Size(std::max(1, static_cast<int>(std::lround(scale * grey.cols))),
                      std::max(1, static_cast<int>(std::lround(scale * grey.rows)))),
             0, 0, cv::INTER_AREA);
  return small;
}

// Grey levels from the darkest to the brightest hundredth.
double RangeOf(const cv::Mat& grey) {
  std::array<std::size_t, 256> num_of_level{};
  for (int y = 0; y < grey.rows; ++y) {
    const auto* row = grey.ptr<std::uint8_t>(y);
    for (int x = 0; x < grey.cols; ++x) ++num_of_level[row[x]];
  }
  const auto level_behind = [&](std::size_t num_before) {
    std::size_t level = 0, num = num_of_level[0];
    while (num <= num_before) num += num_of_level[++level];
    return static_cast<double>(level);
  };
  const std::size_t hundredth = grey.total() / 100;
  return level_behind(grey.total() - 1 - hundredth) - level_behind(hundredth);
}

double ContrastOfFeatures(const cv::Mat& grey) {
  const double of_range = kSiftContrast * std::min(1.0, RangeOf(grey) / kUsualRange);
  const double of_noise = kContrastOfNoise * MeasureNoise(grey).flat;
  return std::min(std::max(of_range, of_noise), kSiftContrast);
}

// The largest first; SIFT's own order where they are alike.
std::vector<std::size_t> BySize(const std::vector<cv::KeyPoint>& keypoints) {
  std::vector<std::size_t> order(keypoints.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return keypoints[a].size > keypoints[b].size; });
  return order;
}

// FNV-1a over the bytes.
std::uint64_t DigestOf(const cv::Mat& bytes) {
  std::uint64_t digest = 0xcbf29ce484222325ULL;
  for (int y = 0; y < bytes.rows; ++y) {
    const auto* row = bytes.ptr<std::uint8_t>(y);
    const std::size_t size = static_cast<std::size_t>(bytes.cols) * bytes.elemSize();
    for (std::size_t i = 0; i < size; ++i) digest = (digest ^ row[i]) * 0x100000001b3ULL;
  }
  return digest;
}

std::array<std::uint8_t, 3> PhotoColourAt(const cv::Mat& bgr, const Eigen::Vector2d& pixel) {
  const int x = ClampedInt(std::round(pixel.x()), 0, bgr.cols - 1);
  const int y = ClampedInt(std::round(pixel.y()), 0, bgr.rows - 1);
  const auto& colour = bgr.at<cv::Vec3b>(y, x);
  return {colour[2], colour[1], colour[0]};
}

}  // namespace

PhotoFeatures ExtractPhotoFeatures(const cv::Mat& bgr, int num_features, int max_side_px) {
  const cv::Mat grey = ShrunkGrey(bgr, max_side_px);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::SIFT::create(num_features, 3, ContrastOfFeatures(grey))
      ->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  PhotoFeatures features;
  if (keypoints.empty()) return features;
  features.digest = DigestOf(descriptors);
  features.descriptors.resize(static_cast<Eigen::Index>(keypoints.size()), kSiftSize);
  const Eigen::Vector2d scale(static_cast<double>(bgr.cols) / grey.cols,
                              static_cast<double>(bgr.rows) / grey.rows);
  for (const std::size_t i : BySize(keypoints)) {
    const auto row = static_cast<Eigen::Index>(features.size());
    const cv::KeyPoint& keypoint = keypoints[i];
    const Eigen::Vector2d shrunk(keypoint.pt.x - kSiftShift_px, keypoint.pt.y - kSiftShift_px);
    features.pixels.emplace_back((shrunk.array() + 0.5) * scale.array() - 0.5);
    features.sigma_px.push_back(kFinestSigma_px * scale.x() *
                                std::max(1.0, keypoint.size / kFinestSize_px));
    features.colours.push_back(PhotoColourAt(bgr, features.pixels.back()));
    const Eigen::Map<const SiftVector> sift(descriptors.ptr<float>(static_cast<int>(i)));
    const float sum = std::max(sift.sum(), 1.0F);
    features.descriptors.row(row) = ToDescriptor((sift / sum).cwiseSqrt());
  }
  return features;
}

PhotoFeatures ExtractPhotoFeatures(const Frame& frame, int num_features, int max_side_px) {
  const cv::Rect content = frame.ContentOrAll();
  PhotoFeatures features = ExtractPhotoFeatures(frame.bgr(content), num_features, max_side_px);
  const Eigen::Vector2d corner(content.x, content.y);
  for (Eigen::Vector2d& pixel : features.pixels) pixel += corner;
  return features;
}

}  // namespace mono3d::tracking
