// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/png_decoder.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <string>

#include "io/image_metadata.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Where libpng goes to when it cannot go on, and why.
struct PngErrors {
  std::jmp_buf leave;
  std::array<char, 128> reason;
};

[[noreturn]] void LeavePng(png_structp png, png_const_charp reason) {
  auto& errors = *static_cast<PngErrors*>(png_get_error_ptr(png));
  std::strncpy(errors.reason.data(), reason, errors.reason.size() - 1);
  std::longjmp(errors.leave, 1);
}

// Pixels have checksums, of which libpng makes errors: a warning is about something else.
void OnPngWarning(png_structp /*png*/, png_const_charp /*text*/) {}

struct PngBytes {
  const char* next;
  std::size_t num_left;
};

void TakePngBytes(png_structp png, png_bytep to, std::size_t num_bytes) {
  auto& bytes = *static_cast<PngBytes*>(png_get_io_ptr(png));
  if (num_bytes > bytes.num_left) LeavePng(png, "the file ends too early");
  std::memcpy(to, bytes.next, num_bytes);
  bytes.next += num_bytes;
  bytes.num_left -= num_bytes;
}

// Chunks without an influence on the pixels that are asked for.
constexpr std::array kPassedOver = {"bKGD", "cHRM", "eXIf", "gAMA", "hIST", "iCCP",
                                    "iTXt", "oFFs", "pCAL", "pHYs", "sBIT", "sCAL",
                                    "sPLT", "sRGB", "tEXt", "tIME", "zTXt"};

// libpng leaves by longjmp, past all destructors: its functions are called by members alone that
// have nothing to destroy.
class PngReader {
 public:
  PngReader(const char* bytes, std::size_t num_bytes) : bytes_{bytes, num_bytes} {}
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  // To the coded pixels; false: it failed.
  bool ReadHead() {
    if (setjmp(errors_.leave) != 0) return false;
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &errors_, LeavePng, OnPngWarning);
    if (png_ == nullptr) return false;
    info_ = png_create_info_struct(png_);
    if (info_ == nullptr) return false;
    for (const char* chunk : kPassedOver) {
      png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER,
                                  reinterpret_cast<png_const_bytep>(chunk), 1);
    }
    png_set_read_fn(png_, &bytes_, TakePngBytes);
    png_read_info(png_, info_);
    return true;
  }

  std::int64_t width() const { return png_get_image_width(png_, info_); }
  std::int64_t height() const { return png_get_image_height(png_, info_); }
  bool has_colour() const {
    return (png_get_color_type(png_, info_) & PNG_COLOR_MASK_COLOR) != 0;  // also of a palette
  }
  bool has_16_bits() const { return png_get_bit_depth(png_, info_) == 16; }

  int TypeOf(PngValues values) const {
    const int depth = has_16_bits() && values != PngValues::kColour8 ? CV_16U : CV_8U;
    return CV_MAKETYPE(depth, values == PngValues::kAsStored ? NumStoredChannels() : 3);
  }

  // All rows, `step` bytes apart, as a cv::Mat of this type has them.
  bool ReadRows(std::uint8_t* first, std::size_t step, int type) {
    if (setjmp(errors_.leave) != 0) return false;
    if (has_16_bits() && CV_MAT_DEPTH(type) == CV_8U) {
      png_set_strip_16(png_);
    } else if (has_16_bits() && std::endian::native == std::endian::little) {
      png_set_swap(png_);
    }
    if (CV_MAT_CN(type) == 4) {
      png_set_tRNS_to_alpha(png_);
    } else {
      png_set_strip_alpha(png_);
    }
    if (png_get_color_type(png_, info_) == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (!has_colour() && png_get_bit_depth(png_, info_) < 8) {
      png_set_expand_gray_1_2_4_to_8(png_);
    }
    if (has_colour()) {
      png_set_bgr(png_);
    } else if (CV_MAT_CN(type) > 1) {
      png_set_gray_to_rgb(png_);
    }
    const int num_passes = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    const png_uint_32 num_rows = png_get_image_height(png_, info_);
    const std::size_t row_bytes = png_get_image_width(png_, info_) * CV_ELEM_SIZE(type);
    if (png_get_rowbytes(png_, info_) != row_bytes) png_error(png_, "rows of another length");
    for (int pass = 0; pass < num_passes; ++pass) {
      for (png_uint_32 y = 0; y < num_rows; ++y) png_read_row(png_, first + y * step, nullptr);
    }
    png_read_end(png_, nullptr);
    return true;
  }

  [[noreturn]] void ThrowError(const std::filesystem::path& path) const {
    throw Error(ErrorParts{.what = "cannot decode the image",
                           .where = path,
                           .expected = {},
                           .found = errors_.reason.data()});
  }

 private:
  int NumStoredChannels() const {
    int num_transparent = 0;
    png_get_tRNS(png_, info_, nullptr, &num_transparent, nullptr);
    switch (png_get_color_type(png_, info_)) {
      case PNG_COLOR_TYPE_GRAY:
        return 1;  // a value that stands for nothing is a value
      case PNG_COLOR_TYPE_RGB:
      case PNG_COLOR_TYPE_PALETTE:
        return num_transparent > 0 ? 4 : 3;
      default:
        return 4;
    }
  }

  PngBytes bytes_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  PngErrors errors_{};
};

}  // namespace

cv::Mat DecodePng(std::string_view bytes, const std::filesystem::path& path, PngValues values) {
  PngReader reader(bytes.data(), bytes.size());
  if (!reader.ReadHead()) reader.ThrowError(path);
  RequireDecodableSize(reader.width(), reader.height(), path);
  const int type = reader.TypeOf(values);
  cv::Mat image(static_cast<int>(reader.height()), static_cast<int>(reader.width()), type);
  if (!reader.ReadRows(image.data, image.step, type)) reader.ThrowError(path);
  return image;
}

}  // namespace mono3d
