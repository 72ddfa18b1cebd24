// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/image_file.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

std::string Encode(const std::string& extension, const cv::Mat& image,
                   const std::vector<int>& parameters) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(extension, image, bytes, parameters)) {
    throw Error("an image cannot be encoded as " + extension);
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string EncodePng(const cv::Mat& image) {
  constexpr int kCompression = 3;  // higher ones take several times as long for a few percent
  return Encode(".png", image, {cv::IMWRITE_PNG_COMPRESSION, kCompression});
}

std::string EncodeJpeg(const cv::Mat& image, int quality) {
  return Encode(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, quality});
}

std::string FrameName(int frame) {
  const std::string digits = std::to_string(frame);
  return std::string(6 - std::min<std::size_t>(digits.size(), 6), '0') + digits;
}

}  // namespace mono3d::tools
