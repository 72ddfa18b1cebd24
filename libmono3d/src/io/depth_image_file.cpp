// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/depth_image_file.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "io/exr_file.h"
#include "io/image_file.h"
#include "io/image_metadata.h"
#include "io/png_decoder.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/pfm_file.h"

namespace mono3d {
namespace {

// Renderers (Blender among them) write this for pixels that see nothing.
constexpr float kNothingSeen = 1e10F;

[[noreturn]] void ThrowBadDepthImage(const std::filesystem::path& path, const std::string& what,
                                     const std::string& expected, const std::string& found) {
  throw Error(ErrorParts{.what = what, .where = path, .expected = expected, .found = found});
}

double ReadScale(const std::filesystem::path& image) {
  const std::filesystem::path path = image.parent_path() / "scale.txt";
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    ThrowBadDepthImage(image, "a depth image in PNG needs a scale (depth = value / scale)",
                       "a scale, or scale.txt in the same folder", "neither");
  }
  const std::string text = ReadBytes(path);
  const std::vector<std::string_view> words = Words(text);
  const std::optional<double> scale = words.empty() ? std::nullopt : ParseNumber(words[0]);
  if (!scale || !(*scale > 0)) {
    ThrowBadDepthImage(path, "bad scale of depth images", "a positive number", text.substr(0, 32));
  }
  return *scale;
}

cv::Mat ReadPng(const std::filesystem::path& path, const std::string& bytes,
                std::optional<double> scale) {
  if (scale && !(*scale > 0 && std::isfinite(*scale))) {
    throw UsageError({"bad scale of a depth image", {}, "a positive number", ToText(*scale)});
  }
  if (!IsCompletePng(bytes)) ThrowBadDepthImage(path, "the image is truncated", {}, {});
  cv::Mat image;
  try {
    image = DecodePng(bytes, path, PngValues::kAsStored);
  } catch (const cv::Exception& exception) {
    ThrowBadDepthImage(path, "cannot decode the image: " + exception.err, {}, {});
  }
  if (image.type() != CV_16UC1) {
    ThrowBadDepthImage(path, "not a depth image", "16 bits in one channel",
                       std::to_string(image.elemSize1() * 8) + " bits in " +
                           std::to_string(image.channels()) + " channels");
  }
  cv::Mat depth;
  image.convertTo(depth, CV_32FC1, 1 / (scale ? *scale : ReadScale(path)));
  return depth;
}

cv::Mat ReadByContent(const std::filesystem::path& path, std::optional<double> png_scale) {
  const std::string bytes = ReadBytes(path);
  if (bytes.starts_with(kPngSignature)) return ReadPng(path, bytes, png_scale);
  if (IsExr(bytes)) return ReadExrDepth(path);
  if (!bytes.starts_with("Pf") && !bytes.starts_with("PF")) {
    ThrowBadDepthImage(path, "not a depth image of a known form", "PFM, 16-bit PNG or OpenEXR", {});
  }
  cv::Mat image = ReadPfm(path);
  if (image.channels() != 1)
    ThrowBadDepthImage(path, "not a depth image", "one channel", "3 channels");
  return image;
}

}  // namespace

cv::Mat ReadDepthImage(const std::filesystem::path& path, std::optional<double> png_scale) {
  cv::Mat depth = ReadByContent(path, png_scale);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      float& z = depth.at<float>(y, x);
      if (!(z > 0 && z < kNothingSeen)) z = 0;  // NaN and infinity as well
    }
  }
  return depth;
}

}  // namespace mono3d
