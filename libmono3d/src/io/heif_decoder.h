// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string_view>

namespace mono3d {

// The primary image in the bytes of a HEIF file (IsHeif) as CV_8UC3 (BGR), as it is stored: EXIF
// says how it is turned, as in other forms. Of more than 8 bits the upper 8. By libheif. Throws
// Error, in which `path` stands for the bytes, where they cannot be decoded or say that the image
// is too large (see RequireDecodableSize).
cv::Mat DecodeHeif(std::string_view bytes, const std::filesystem::path& path);

}  // namespace mono3d
