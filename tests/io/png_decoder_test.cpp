// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/png_decoder.h"

#include <gmock/gmock.h>
#include <png.h>

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

struct PngForm {
  int colour_type = PNG_COLOR_TYPE_RGB;
  int bit_depth = 8;
  bool is_interlaced = false;
  bool has_transparency = false;  // tRNS
  bool has_texts = false;         // and a gamma
};

void AppendBytes(png_structp png, png_bytep bytes, std::size_t num_bytes) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), num_bytes);
}

void FlushNothing(png_structp /*png*/) {}

// Of noise: every value of every form.
std::string PngBytes(const PngForm& form, int width = 67, int height = 41) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &bytes, AppendBytes, FlushNothing);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
               form.bit_depth, form.colour_type,
               form.is_interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  std::array<png_color, 256> palette{};
  std::array<png_byte, 256> alpha{};
  for (std::size_t i = 0; i < palette.size(); ++i) {
    palette[i] = {static_cast<png_byte>(i * 7), static_cast<png_byte>(255 - i),
                  static_cast<png_byte>(i * i)};
    alpha[i] = static_cast<png_byte>(i * 5);
  }
  const int num_colours = 1 << std::min(form.bit_depth, 8);
  if (form.colour_type == PNG_COLOR_TYPE_PALETTE) {
    png_set_PLTE(png, info, palette.data(), num_colours);
  }
  png_color_16 value{.index = 0, .red = 1, .green = 2, .blue = 3, .gray = 1};
  if (form.has_transparency) png_set_tRNS(png, info, alpha.data(), num_colours, &value);
  std::array<char, 8> key = {"Comment"};
  std::array<char, 6> words = {"hello"};
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_zTXt;
  text.key = key.data();
  text.text = words.data();
  if (form.has_texts) {
    png_set_text(png, info, &text, 1);
    png_set_gAMA(png, info, 0.3);
  }
  png_write_info(png, info);
  const int num_passes = png_set_interlace_handling(png);
  cv::Mat rows(height, static_cast<int>(png_get_rowbytes(png, info)), CV_8UC1);
  cv::RNG(11).fill(rows, cv::RNG::UNIFORM, 0, 256);
  for (int pass = 0; pass < num_passes; ++pass) {
    for (int y = 0; y < height; ++y) png_write_row(png, rows.ptr(y));
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

cv::Mat PngByOpenCv(const std::string& bytes, PngValues values) {
  const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  switch (values) {
    case PngValues::kColour8:
      return cv::imdecode(data, cv::IMREAD_COLOR);
    case PngValues::kColour:
      return cv::imdecode(data, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
    default:
      return cv::imdecode(data, cv::IMREAD_UNCHANGED);
  }
}

void ExpectPngAsByOpenCv(const std::string& bytes, const std::string& what) {
  for (const PngValues values : {PngValues::kColour8, PngValues::kColour, PngValues::kAsStored}) {
    const cv::Mat expected = PngByOpenCv(bytes, values);
    const cv::Mat image = DecodePng(bytes, "image.png", values);
    ASSERT_FALSE(expected.empty()) << what;
    ASSERT_EQ(image.size(), expected.size()) << what;
    ASSERT_EQ(image.type(), expected.type()) << what << ", " << static_cast<int>(values);
    EXPECT_EQ(cv::norm(image, expected, cv::NORM_INF), 0)
        << what << ", " << static_cast<int>(values);
  }
}

// All colour types and bit depths that there are.
std::vector<PngForm> PngForms() {
  std::vector<PngForm> forms;
  for (const int colour_type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_PALETTE,
                                PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB_ALPHA}) {
    for (const int bit_depth : {1, 2, 4, 8, 16}) {
      const bool may_be_small =
          colour_type == PNG_COLOR_TYPE_GRAY || colour_type == PNG_COLOR_TYPE_PALETTE;
      if (bit_depth < 8 && !may_be_small) continue;
      if (bit_depth == 16 && colour_type == PNG_COLOR_TYPE_PALETTE) continue;
      const bool may_have_transparency = (colour_type & PNG_COLOR_MASK_ALPHA) == 0;
      for (const bool is_interlaced : {false, true}) {
        for (const bool has_transparency : {false, true}) {
          if (has_transparency && !may_have_transparency) continue;
          for (const bool has_texts : {false, true}) {
            forms.push_back({colour_type, bit_depth, is_interlaced, has_transparency, has_texts});
          }
        }
      }
    }
  }
  return forms;
}

TEST(PngDecoder, GivesThePixelsOfOpenCvInEachForm) {
  const std::vector<PngForm> forms = PngForms();
  EXPECT_EQ(forms.size(), 4U * (15 + 11)) << "15 of the standard, 11 of them also with tRNS";
  for (const PngForm& form : forms) {
    ExpectPngAsByOpenCv(PngBytes(form), "colour type " + std::to_string(form.colour_type) + ", " +
                                            std::to_string(form.bit_depth) + " bits, interlaced " +
                                            std::to_string(form.is_interlaced) + ", tRNS " +
                                            std::to_string(form.has_transparency) + ", texts " +
                                            std::to_string(form.has_texts));
  }
}

TEST(PngDecoder, GivesThePixelsOfOpenCvAtEachSize) {
  for (const int width : {1, 2, 7, 8, 9, 333}) {
    for (const int height : {1, 5, 8, 33}) {
      for (const bool is_interlaced : {false, true}) {
        for (const int bit_depth : {8, 16}) {
          ExpectPngAsByOpenCv(
              PngBytes({.bit_depth = bit_depth, .is_interlaced = is_interlaced}, width, height),
              std::to_string(width) + "x" + std::to_string(height));
        }
      }
    }
  }
}

TEST(PngDecoder, SaysWhatIsDamaged) {
  const std::string bytes = PngBytes({});
  std::string damaged = bytes;
  damaged[bytes.size() / 2] = static_cast<char>(damaged[bytes.size() / 2] + 1);
  EXPECT_THROW(DecodePng(damaged, "image.png", PngValues::kColour8), Error);
  std::string with_checksum = bytes;
  const std::size_t checksum = bytes.size() - 12 - 4;  // of the pixels; the end takes 12 bytes
  with_checksum[checksum] = static_cast<char>(with_checksum[checksum] + 1);
  EXPECT_THAT([&] { DecodePng(with_checksum, "image.png", PngValues::kColour8); },
              ThrowsMessage<Error>(
                  HasSubstr("image.png: cannot decode the image (found IDAT: CRC error)")));
  EXPECT_THAT(
      [&] { DecodePng(bytes.substr(0, bytes.size() / 2), "image.png", PngValues::kAsStored); },
      ThrowsMessage<Error>(HasSubstr("the file ends too early")));
  EXPECT_THROW(DecodePng("no image", "image.png", PngValues::kColour8), Error);
  EXPECT_THROW(DecodePng("", "image.png", PngValues::kColour8), Error);
}

// A byte of the pixels that is not what was written is never taken: they have a checksum.
TEST(PngDecoder, FindsEveryFlippedBitOfThePixelsAndPrintsNothing) {
  const std::string bytes = PngBytes({.is_interlaced = true, .has_texts = true});
  const cv::Mat whole = DecodePng(bytes, "image.png", PngValues::kColour8);
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  for (std::size_t byte = 0; byte < bytes.size(); ++byte) {
    std::string damaged = bytes;
    damaged[byte] = static_cast<char>(static_cast<std::uint8_t>(damaged[byte]) ^ 1U << byte % 8);
    try {
      const cv::Mat image = DecodePng(damaged, "image.png", PngValues::kColour8);
      EXPECT_EQ(cv::norm(image, whole, cv::NORM_INF), 0) << byte;
    } catch (const Error&) {
      continue;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(PngDecoder, RefusesWhatSaysItIsHuge) {
  std::string bytes = PngBytes({});
  // Of the right checksum, so that libpng takes it.
  bytes.replace(16, 8, std::string("\0\0\x7D\0\0\0\x7D\0", 8));
  std::uint32_t checksum = 0xFFFFFFFFU;
  for (std::size_t i = 12; i < 29; ++i) {
    checksum ^= static_cast<std::uint8_t>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) {
      checksum = checksum >> 1U ^ ((checksum & 1U) != 0 ? 0xEDB88320U : 0U);
    }
  }
  checksum = ~checksum;
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[29 + i] = static_cast<char>(checksum >> (24 - 8 * i));
  }
  for (const PngValues values : {PngValues::kColour, PngValues::kAsStored}) {
    EXPECT_THAT([&] { DecodePng(bytes, "image.png", values); },
                ThrowsMessage<Error>(HasSubstr("the image is too large (expected at most 268435456 "
                                               "pixels, found 32000x32000)")));
  }
}

}  // namespace
}  // namespace mono3d
