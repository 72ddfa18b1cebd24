// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace mono3d {

// The first bytes of every PNG file.
inline constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1A\n";

// What an image file says beside its pixels, as it is stored.
struct ImageMetadata {
  int width = 0;     // px; 0: the form of the file is not one of those below
  int height = 0;    // px
  std::string exif;  // with its header "Exif\0\0"; empty: none
  std::string xmp;   // an XML document; empty: none
};

// Of a JPEG file (up to its coded pixels), a PNG, BMP, PGM or PPM file (its size alone), a HEIF
// file or a TIFF file (all of it, as its directories may be anywhere; size and XMP are among the
// EXIF tags). What follows a damage is missing. Throws Error when the file cannot be read.
ImageMetadata ReadImageMetadata(const std::filesystem::path& path);

// Before memory is taken for it: a small file may say that its image is huge. Throws Error where
// there are more than 268 million pixels or none.
void RequireDecodableSize(std::int64_t width, std::int64_t height,
                          const std::filesystem::path& path);

}  // namespace mono3d
