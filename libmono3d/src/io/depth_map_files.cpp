// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/depth_map_files.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/pfm_file.h"

namespace mono3d {
namespace {

// A few wild depths must not take the colours from all others.
constexpr double kLowQuantile = 0.02;
constexpr double kHighQuantile = 0.98;

std::uint8_t ToByte(double share) { return cv::saturate_cast<std::uint8_t>(255 * share); }

// The quantiles of the inverse depths; equal ones when there is nothing to tell apart.
std::pair<float, float> InverseDepthRange(const cv::Mat& depth) {
  std::vector<float> inverse;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const float z = depth.at<float>(y, x);
      if (z > 0) inverse.push_back(1 / z);
    }
  }
  if (inverse.empty()) return {0, 0};
  return {Quantile(inverse, kLowQuantile), Quantile(inverse, kHighQuantile)};
}

}  // namespace

cv::Mat DepthPreview(const cv::Mat& depth) {
  const auto [low, high] = InverseDepthRange(depth);
  cv::Mat level(depth.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const float z = depth.at<float>(y, x);
      if (z > 0)
        level.at<std::uint8_t>(y, x) = ToByte(high > low ? (1 / z - low) / (high - low) : 0.5);
    }
  }
  cv::Mat preview;
  cv::applyColorMap(level, preview, cv::COLORMAP_TURBO);
  preview.setTo(cv::Scalar::all(0), depth <= 0);
  return preview;
}

cv::Mat NormalPreview(const cv::Mat& normal) {
  cv::Mat preview(normal.size(), CV_8UC3, cv::Scalar::all(0));
  for (int y = 0; y < normal.rows; ++y) {
    for (int x = 0; x < normal.cols; ++x) {
      const auto& n = normal.at<cv::Vec3f>(y, x);
      if (n == cv::Vec3f(0, 0, 0)) continue;
      preview.at<cv::Vec3b>(y, x) = {ToByte((1 - n[2]) / 2), ToByte((1 - n[1]) / 2),
                                     ToByte((1 + n[0]) / 2)};
    }
  }
  return preview;
}

cv::Mat ConfidencePreview(const cv::Mat& confidence) {
  cv::Mat grey;
  confidence.convertTo(grey, CV_8UC1, 255);
  cv::Mat preview;
  cv::cvtColor(grey, preview, cv::COLOR_GRAY2BGR);
  return preview;
}

void WritePng(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (image.empty() || image.depth() != CV_8U || !cv::imencode(".png", image, bytes)) {
    throw Error(ErrorParts{.what = "cannot be written as PNG",
                           .where = path,
                           .expected = "an 8-bit image",
                           .found = cv::typeToString(image.type())});
  }
  WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                      Durability::kInCache);  // a run writes thousands
}

void WriteDepthMap(const std::filesystem::path& folder, const std::string& name,
                   const DepthMap& map) {
  Validate(map);
  const auto write = [&](const char* kind, const cv::Mat& image, auto preview) {
    if (image.empty()) return;
    WritePfm(folder / (name + "." + kind + ".pfm"), image);
    WritePng(folder / (name + "." + kind + ".png"), preview(image));
  };
  write("depth", map.depth, DepthPreview);
  write("normal", map.normal, NormalPreview);
  write("confidence", map.confidence, ConfidencePreview);
  if (!map.inferred.empty()) WritePng(folder / (name + ".inferred.png"), map.inferred);
}

}  // namespace mono3d
