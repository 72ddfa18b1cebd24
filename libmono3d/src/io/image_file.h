// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d {

// Reads a JPEG, PNG, BMP, TIFF, WebP, PBM, PGM or PPM image as CV_8UC3 (BGR): grey is repeated, of
// the lowest `value_bits` of 16 bits the upper 8 are taken (larger values are white), alpha is
// dropped, the orientation tag is ignored (the calibration is of the pixels as they are stored).
// Throws Error when the file cannot be decoded to its end; OpenCV itself returns a truncated JPEG
// as an image that is grey from some row on.
cv::Mat ReadImage(const std::filesystem::path& path, int value_bits = 16);

// How many bits the values of images use: 16, or as few as 8 where the largest value of some of
// them needs 14 or fewer. Cameras of 10, 12 or 14 bits leave the upper bits empty, and the upper 8
// of 16 would be black. Of images of 8 bits it is 16. What cannot be read is passed over.
int FindValueBits(const std::vector<std::string>& images);

// Before it is decoded: a small file may say that its image is huge. Throws Error when it has more
// than 268 million pixels.
void RequireDecodableSize(const std::filesystem::path& path);

// Do the chunks of the PNG file with these bytes go on to the last one?
bool IsCompletePng(std::string_view bytes);

}  // namespace mono3d
