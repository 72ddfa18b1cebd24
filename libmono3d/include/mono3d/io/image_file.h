// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Reads a JPEG, PNG, BMP, TIFF, WebP, PBM, PGM or PPM image as CV_8UC3 (BGR): grey is repeated, of
// the lowest `value_bits` of 16 bits the upper 8 are taken (larger values are white), alpha is
// dropped, the orientation tag is ignored (the calibration is of the pixels as they are stored).
// Throws Error when the file cannot be decoded to its end (OpenCV itself returns a truncated JPEG
// as an image that is grey from some row on), is of another form, no regular file, or of more than
// 268 million pixels.
cv::Mat ReadImage(const std::filesystem::path& path, int value_bits = 16);

// The same at an eighth of the size, rounded, which is much less work of a JPEG file.
cv::Mat ReadSmallImage(const std::filesystem::path& path);

}  // namespace mono3d
