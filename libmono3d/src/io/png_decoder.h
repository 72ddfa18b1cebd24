// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string_view>

namespace mono3d {

enum class PngValues {
  kColour8,   // CV_8UC3 (BGR): grey is repeated, alpha dropped, of 16 bits the upper 8 are taken
  kColour,    // the same, but CV_16UC3 where the file has 16 bits
  kAsStored,  // 8 or 16 bits; CV_8UC1, CV_8UC3 (BGR) or with alpha CV_8UC4, or of 16 bits
};

// The image in the bytes of a PNG file, bit for bit that of cv::imdecode with IMREAD_COLOR, that
// and IMREAD_ANYDEPTH, or IMREAD_UNCHANGED. By libpng without OpenCV, which lets it print. Of the
// other parts of the file, such as texts and profiles, nothing is read. Throws Error, in which
// `path` stands for the bytes, where they cannot be decoded, a checksum is wrong or the image is
// said to be too large (see RequireDecodableSize).
cv::Mat DecodePng(std::string_view bytes, const std::filesystem::path& path, PngValues values);

}  // namespace mono3d
