// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string_view>

namespace mono3d {

// The image in the bytes of a JPEG file as CV_8UC3 (BGR), bit for bit that of cv::imdecode, at its
// size divided by `reduction` (1, 2, 4 or 8), rounded up. By libjpeg without OpenCV, which lets it
// print and takes whatever it makes of damaged data. Throws Error, in which `path` stands for the
// bytes, where they cannot be decoded, contradict themselves, say that the image is too large (see
// RequireDecodableSize) or refine it endlessly. What contradicts nothing is not noticed: a JPEG
// file has no checksum. Bytes behind the data of the last row are damage where they are blocks of
// the image (see jpeg_scan.h), and what a camera left there where not; so are a few bytes before a
// restart marker.
cv::Mat DecodeJpeg(std::string_view bytes, const std::filesystem::path& path, int reduction = 1);

}  // namespace mono3d
