// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/depth_map_files.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/exr_file.h"
#include "io/image_file.h"
#include "io/image_metadata.h"
#include "io/png_decoder.h"
#include "io/text.h"
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

constexpr const char* kDepth = "depth";
constexpr const char* kNormal = "normal";
constexpr const char* kConfidence = "confidence";
constexpr const char* kPng16Ending = "16.png";
constexpr double kLargest16 = 65535;

cv::Mat Depth16(const cv::Mat& depth) {
  cv::Mat scaled = depth * kDepthPngScale;
  scaled.setTo(0, scaled > kLargest16);
  cv::Mat values;
  scaled.convertTo(values, CV_16U);
  return values;
}

cv::Mat Normal16(const cv::Mat& normal) {
  cv::Mat values(normal.size(), CV_16UC3, cv::Scalar::all(0));
  const auto to_16 = [](float share) {
    return cv::saturate_cast<std::uint16_t>(kLargest16 * (1 + share) / 2);
  };
  for (int y = 0; y < normal.rows; ++y) {
    for (int x = 0; x < normal.cols; ++x) {
      const auto& n = normal.at<cv::Vec3f>(y, x);
      if (n == cv::Vec3f(0, 0, 0)) continue;
      values.at<cv::Vec3w>(y, x) = {to_16(n[2]), to_16(n[1]), to_16(n[0])};  // BGR
    }
  }
  return values;
}

cv::Mat Confidence16(const cv::Mat& confidence) {
  cv::Mat values;
  confidence.convertTo(values, CV_16U, kLargest16);
  return values;
}

void WriteEncoded(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", image, bytes)) throw Error(path.string() + ": cannot be made a PNG");
  WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                      Durability::kInCache);  // a run writes thousands
}

// `stem`: the file without the ending of the form.
void WriteLayer(const std::string& stem, std::string_view kind, const cv::Mat& image,
                DepthFileForm form) {
  if (form == DepthFileForm::kExr) {
    const bool is_half = kind != kDepth;
    WriteFileAtomically(stem + ".exr", ExrBytes(image, is_half), Durability::kInCache);
  } else if (form == DepthFileForm::kPng16) {
    WriteEncoded(stem + kPng16Ending, kind == kDepth    ? Depth16(image)
                                      : kind == kNormal ? Normal16(image)
                                                        : Confidence16(image));
  } else {
    WritePfm(stem + ".pfm", image);
  }
}

// Values from 0 to 1 in CV_32F.
cv::Mat ReadPng16(const std::filesystem::path& path, int num_channels) {
  const std::string bytes = ReadBytes(path);
  cv::Mat image;
  if (bytes.starts_with(kPngSignature) && IsCompletePng(bytes)) {
    image = DecodePng(bytes, path, PngValues::kAsStored);
  }
  if (image.type() != CV_16UC(num_channels)) {
    throw Error(
        ErrorParts{.what = "not an image of a depth map",
                   .where = path,
                   .expected = "a PNG of 16 bits in " + std::to_string(num_channels) + " channels",
                   .found = image.empty() ? "" : cv::typeToString(image.type())});
  }
  cv::Mat values;
  image.convertTo(values, CV_32F, 1 / kLargest16);
  return values;
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
  if (image.empty() || image.depth() != CV_8U) {
    throw Error(ErrorParts{.what = "cannot be written as PNG",
                           .where = path,
                           .expected = "an 8-bit image",
                           .found = cv::typeToString(image.type())});
  }
  WriteEncoded(path, image);
}

namespace {

// Every `step_px`th pixel of every `step_px`th row, the first ones included.
cv::Mat Thinned(const cv::Mat& image, int step_px) {
  if (step_px <= 1) return image;
  cv::Mat thinned((image.rows + step_px - 1) / step_px, (image.cols + step_px - 1) / step_px,
                  image.type());
  const std::size_t size = image.elemSize();
  for (int y = 0; y < thinned.rows; ++y) {
    const std::uint8_t* from = image.ptr(y * step_px);
    std::uint8_t* to = thinned.ptr(y);
    for (int x = 0; x < thinned.cols; ++x, from += size * static_cast<std::size_t>(step_px)) {
      to = std::copy_n(from, size, to);
    }
  }
  return thinned;
}

}  // namespace

void WriteDepthMap(const std::filesystem::path& folder, const std::string& name,
                   const DepthMap& map, const DepthFileOptions& options) {
  Validate(map);
  if (options.form == DepthFileForm::kNone) return;
  const auto write = [&](const char* kind, const cv::Mat& image, auto preview) {
    if (image.empty()) return;
    const std::string stem = (folder / (name + "." + kind)).string();
    WriteLayer(stem, kind, image, options.form);
    if (options.with_previews) {
      WritePng(stem + ".png", preview(Thinned(image, options.preview_step_px)));
    }
  };
  write(kDepth, map.depth, DepthPreview);
  write(kNormal, map.normal, NormalPreview);
  write(kConfidence, map.confidence, ConfidencePreview);
  if (!map.inferred.empty()) WritePng(folder / (name + ".inferred.png"), map.inferred);
}

std::vector<std::string> DepthFileEndings(const std::string& kind) {
  return {"." + kind + ".pfm", "." + kind + ".exr", "." + kind + kPng16Ending};
}

cv::Mat ReadConfidence(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (name.ends_with(".exr")) return ReadExrDepth(path);
  if (name.ends_with(kPng16Ending)) return ReadPng16(path, 1);
  return ReadPfm(path);
}

cv::Mat ReadNormals(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (name.ends_with(".exr")) return ReadExrColours(path);
  if (!name.ends_with(kPng16Ending)) return ReadPfm(path);
  cv::Mat colours = ReadPng16(path, 3);
  cv::Mat normals;
  cv::cvtColor(colours, normals, cv::COLOR_BGR2RGB);
  for (auto it = normals.begin<cv::Vec3f>(); it != normals.end<cv::Vec3f>(); ++it) {
    if (*it != cv::Vec3f(0, 0, 0)) *it = 2 * *it - cv::Vec3f(1, 1, 1);
  }
  return normals;
}

}  // namespace mono3d
