// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <libheif/heif.h>

#include <memory>
#include <string>
#include <string_view>

namespace mono3d {

// Deleter of an object of libheif.
template <auto kRelease>
struct HeifRelease {
  template <typename Object>
  void operator()(Object* object) const {
    kRelease(object);
  }
};

// The primary image of the bytes of a HEIF file, which must outlive it.
struct HeifFile {
  std::unique_ptr<heif_context, HeifRelease<heif_context_free>> context;
  std::unique_ptr<heif_image_handle, HeifRelease<heif_image_handle_release>> primary;
  heif_error error = {};  // why there is none
};

// Is it a HEIC, HEIF or AVIF image (ISO/IEC 23008-12), by the first 12 bytes of the file? Phones
// write photographs in these forms.
bool IsHeif(std::string_view bytes);

HeifFile OpenHeif(std::string_view bytes);

// Of a file with a primary image: EXIF as a JPEG file has it, with the header "Exif\0\0", and XMP;
// empty: none.
std::string ExifOf(const HeifFile& file);
std::string XmpOf(const HeifFile& file);

}  // namespace mono3d
