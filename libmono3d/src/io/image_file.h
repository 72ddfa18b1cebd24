// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string_view>

namespace mono3d {

// Reads a JPEG, PNG, BMP, TIFF, WebP, PBM, PGM or PPM image as CV_8UC3 (BGR): grey is repeated, 16
// bits are cut to the upper 8, alpha is dropped, the orientation tag is ignored (the calibration is
// of the pixels as they are stored). Throws Error when the file cannot be decoded to its end;
// OpenCV itself returns a truncated JPEG as an image that is grey from some row on.
cv::Mat ReadImage(const std::filesystem::path& path);

// Before it is decoded: a small file may say that its image is huge. Throws Error when it has more
// than 268 million pixels.
void RequireDecodableSize(const std::filesystem::path& path);

// Do the chunks of the PNG file with these bytes go on to the last one?
bool IsCompletePng(std::string_view bytes);

}  // namespace mono3d
