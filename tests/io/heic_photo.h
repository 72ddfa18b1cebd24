// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace mono3d {

// The bytes of a HEIC file, by libheif's encoder of HEVC, as a phone writes it; empty where it has
// none. `tiff`: EXIF without its header (ExifWriter::Tiff), where not empty.
std::string HeicPhoto(const cv::Mat& bgr, const std::string& tiff = {});

}  // namespace mono3d
