// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/jpeg_decoder.h"

#include <gmock/gmock.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

// clang-format off: it needs what stands before it
#include <jpeglib.h>
// clang-format on

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct JpegForm {
  J_COLOR_SPACE space = JCS_RGB;  // of the pixels
  int num_channels = 3;
  J_COLOR_SPACE stored = JCS_YCbCr;
  int sampling_x = 2;  // of the first component
  int sampling_y = 2;
  bool is_progressive = false;
  bool is_arithmetic = false;
  int restart_rows = 0;
  int quality = 90;
};

// Smooth structure with noise, so that all coefficients are used.
cv::Mat Texture(int width, int height, int num_channels) {
  cv::Mat image(height, width, CV_8UC(num_channels));
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {0, 0}, 1.5);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

std::string JpegBytes(const cv::Mat& image, const JpegForm& form) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long num_bytes = 0;  // NOLINT: libjpeg's type
  jpeg_mem_dest(&info, &bytes, &num_bytes);
  info.image_width = static_cast<JDIMENSION>(image.cols);
  info.image_height = static_cast<JDIMENSION>(image.rows);
  info.input_components = form.num_channels;
  info.in_color_space = form.space;
  jpeg_set_defaults(&info);
  jpeg_set_colorspace(&info, form.stored);
  jpeg_set_quality(&info, form.quality, TRUE);
  info.comp_info[0].h_samp_factor = form.sampling_x;
  info.comp_info[0].v_samp_factor = form.sampling_y;
  info.restart_in_rows = form.restart_rows;
  info.arith_code = form.is_arithmetic ? TRUE : FALSE;
  if (form.is_progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < image.rows; ++y) {
    auto* row = const_cast<unsigned char*>(image.ptr(y));
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  std::string result(reinterpret_cast<char*>(bytes), num_bytes);
  std::free(bytes);
  return result;
}

std::string JpegBytes(const JpegForm& form, int width = 203, int height = 117) {
  return JpegBytes(Texture(width, height, form.num_channels), form);
}

cv::Mat JpegByOpenCv(const std::string& bytes, int flags = cv::IMREAD_COLOR) {
  const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  return cv::imdecode(data, flags | cv::IMREAD_IGNORE_ORIENTATION);
}

void ExpectJpegAsByOpenCv(const std::string& bytes, const std::string& what) {
  constexpr std::array kFlags = {cv::IMREAD_COLOR, cv::IMREAD_REDUCED_COLOR_2,
                                 cv::IMREAD_REDUCED_COLOR_4, cv::IMREAD_REDUCED_COLOR_8};
  for (std::size_t i = 0; i < kFlags.size(); ++i) {
    const cv::Mat expected = JpegByOpenCv(bytes, kFlags[i]);
    const cv::Mat image = DecodeJpeg(bytes, "image.jpg", 1 << i);
    ASSERT_EQ(image.size(), expected.size()) << what << " at 1/" << (1 << i);
    ASSERT_EQ(image.type(), CV_8UC3) << what;
    EXPECT_EQ(cv::norm(image, expected, cv::NORM_INF), 0) << what << " at 1/" << (1 << i);
  }
}

// The byte at which the coded pixels of the first scan begin.
std::size_t ScanBegin(const std::string& bytes) {
  const std::size_t marker = bytes.find("\xFF\xDA");
  return marker + 2 + static_cast<std::uint8_t>(bytes[marker + 3]);
}

std::string WithFlippedBit(std::string bytes, std::size_t byte, int bit) {
  bytes[byte] = static_cast<char>(static_cast<std::uint8_t>(bytes[byte]) ^ 1U << bit);
  return bytes;
}

// Sixteen bits that are one are no code, wherever the codes before them end.
std::string WithoutCodes(std::string bytes) {
  const std::size_t middle = (ScanBegin(bytes) + bytes.size()) / 2;
  for (std::size_t i = 0; i < 20; ++i) {
    bytes.replace(middle + 2 * i, 2, std::string("\xFF\0", 2));
  }
  return bytes;
}

auto SaysDamaged() {
  return ThrowsMessage<Error>(HasSubstr("image.jpg: the image is damaged: copy it again"));
}

TEST(JpegDecoder, GivesThePixelsOfOpenCvInEachForm) {
  const std::vector<std::pair<std::string, JpegForm>> forms = {
      {"4:2:0", {}},
      {"4:2:2", {.sampling_y = 1}},
      {"4:4:0", {.sampling_x = 1}},
      {"4:4:4", {.sampling_x = 1, .sampling_y = 1}},
      {"4:1:1", {.sampling_x = 4, .sampling_y = 1}},
      {"stored as RGB", {.stored = JCS_RGB, .sampling_x = 1, .sampling_y = 1}},
      {"grey",
       {.space = JCS_GRAYSCALE,
        .num_channels = 1,
        .stored = JCS_GRAYSCALE,
        .sampling_x = 1,
        .sampling_y = 1}},
      {"CMYK",
       {.space = JCS_CMYK,
        .num_channels = 4,
        .stored = JCS_CMYK,
        .sampling_x = 1,
        .sampling_y = 1}},
      {"YCCK", {.space = JCS_CMYK, .num_channels = 4, .stored = JCS_YCCK}},
      {"restart markers", {.restart_rows = 1}},
      {"of the lowest quality", {.quality = 1}},
      {"of the highest quality", {.quality = 100}},
  };
  for (const auto& [name, sequential] : forms) {
    for (const bool is_progressive : {false, true}) {
      for (const bool is_arithmetic : {false, true}) {
        JpegForm form = sequential;
        form.is_progressive = is_progressive;
        form.is_arithmetic = is_arithmetic;
        ExpectJpegAsByOpenCv(JpegBytes(form), name + (is_progressive ? ", progressive" : "") +
                                                  (is_arithmetic ? ", arithmetic" : ""));
      }
    }
  }
}

TEST(JpegDecoder, GivesThePixelsOfOpenCvAtEachSize) {
  for (const int width : {1, 7, 8, 9, 16, 17, 333}) {
    for (const int height : {1, 8, 15, 33}) {
      for (const int sampling : {1, 2}) {
        const JpegForm form = {.sampling_x = sampling, .sampling_y = sampling};
        ExpectJpegAsByOpenCv(JpegBytes(form, width, height),
                             std::to_string(width) + "x" + std::to_string(height));
      }
    }
  }
}

// Pixels are taken as they are stored.
TEST(JpegDecoder, TurnsNothing) {
  const std::string exif(
      "\xFF\xE1\0\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
      36);
  std::string bytes = JpegBytes({});
  bytes.insert(2, exif);
  const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  ASSERT_EQ(cv::imdecode(data, cv::IMREAD_COLOR).rows, 203) << "OpenCV finds the tag";
  ExpectJpegAsByOpenCv(bytes, "with an orientation");
}

TEST(JpegDecoder, SaysWhatIsDamaged) {
  const std::string bytes = JpegBytes({});
  // libjpeg tells of bits that are no code where little follows, and in progressive files.
  const std::string small = WithoutCodes(JpegBytes({}, 32, 32));
  const std::string progressive = WithoutCodes(JpegBytes({.is_progressive = true}));
  for (const std::string& damaged : {small, progressive}) {
    EXPECT_THAT([&] { DecodeJpeg(damaged, "image.jpg"); },
                AllOf(SaysDamaged(), ThrowsMessage<Error>(
                                         HasSubstr("found Corrupt JPEG data: bad Huffman code"))));
  }
  EXPECT_THAT(
      [&] { DecodeJpeg(WithoutCodes(bytes), "image.jpg"); },
      AllOf(SaysDamaged(),
            ThrowsMessage<Error>(HasSubstr("found coded pixels that contradict themselves"))));
  std::string short_scan = bytes;
  short_scan.erase(ScanBegin(bytes) + 1000, 2000);
  EXPECT_THAT([&] { DecodeJpeg(short_scan, "image.jpg"); },
              AllOf(SaysDamaged(), ThrowsMessage<Error>(HasSubstr("premature end of data"))));
  EXPECT_THAT([&] { DecodeJpeg(bytes.substr(0, bytes.size() / 2), "image.jpg"); },
              AllOf(SaysDamaged(), ThrowsMessage<Error>(HasSubstr("Premature end of JPEG file"))));
  EXPECT_THAT([&] { DecodeJpeg(short_scan, "image.jpg", 8); }, SaysDamaged());
  std::string without_interval = JpegBytes({.restart_rows = 1});
  const std::size_t first = without_interval.find("\xFF\xD0");
  without_interval.erase(first, without_interval.find("\xFF\xD1") - first);
  EXPECT_THAT([&] { DecodeJpeg(without_interval, "image.jpg"); }, SaysDamaged());
}

// Printing is for programs.
TEST(JpegDecoder, PrintsNothing) {
  const std::string bytes = JpegBytes({});
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  for (std::size_t byte = 2; byte < bytes.size(); byte += 7) {
    try {
      DecodeJpeg(WithFlippedBit(bytes, byte, static_cast<int>(byte % 8)), "image.jpg");
    } catch (const Error&) {
      continue;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(JpegDecoder, TakesWhatCamerasLeaveBehindTheLastRow) {
  for (const bool is_progressive : {false, true}) {
    const std::string bytes = JpegBytes({.is_progressive = is_progressive});
    const cv::Mat expected = JpegByOpenCv(bytes);
    cv::RNG random(5);
    for (int i = 0; i < 100; ++i) {
      std::string left(static_cast<std::size_t>(random.uniform(9, 300)), '\0');
      if (i > 0) {
        for (char& byte : left) byte = static_cast<char>(random.uniform(0, 255));  // no marker
      }
      std::string with_left = bytes;
      with_left.insert(bytes.size() - 2, left + std::string("\xFF\0\x01", 3));
      EXPECT_EQ(cv::norm(DecodeJpeg(with_left, "image.jpg"), expected, cv::NORM_INF), 0) << i;
    }
  }
}

// Codes find back into step behind damage, and blocks are over at the end.
TEST(JpegDecoder, FindsBlocksBehindTheLastRow) {
  const std::vector<JpegForm> forms = {{},
                                       {.sampling_x = 1, .sampling_y = 1},
                                       {.space = JCS_GRAYSCALE,
                                        .num_channels = 1,
                                        .stored = JCS_GRAYSCALE,
                                        .sampling_x = 1,
                                        .sampling_y = 1}};
  for (const JpegForm& form : forms) {
    // A row of units more than the size says.
    const int unit_px = 8 * form.sampling_y;
    std::string bytes = JpegBytes(form, 203, 6 * unit_px);
    const std::size_t frame = bytes.find("\xFF\xC0");
    const auto lines = static_cast<std::uint8_t>(bytes[frame + 6]);
    ASSERT_EQ(lines, 6 * unit_px);
    EXPECT_NO_THROW(DecodeJpeg(bytes, "image.jpg"));
    bytes[frame + 6] = static_cast<char>(lines - unit_px);
    EXPECT_THAT([&] { DecodeJpeg(bytes, "image.jpg"); },
                AllOf(SaysDamaged(),
                      ThrowsMessage<Error>(HasSubstr("coded pixels that contradict themselves"))));
  }
}

// Where a block of a disk is lost: mostly without a code that is none.
TEST(JpegDecoder, FindsMostLostBlocksOfADisk) {
  constexpr std::size_t kBlock_bytes = 512;
  const std::string bytes = JpegBytes({}, 320, 240);
  int num_found = 0;
  int num_lost = 0;
  for (std::size_t at = ScanBegin(bytes); at + 2 * kBlock_bytes < bytes.size();
       at += kBlock_bytes) {
    std::string damaged = bytes;
    cv::RNG random(at);
    for (std::size_t i = 0; i < kBlock_bytes; ++i) {
      damaged[at + i] = static_cast<char>(random.uniform(0, 255));
    }
    ++num_lost;
    try {
      DecodeJpeg(damaged, "image.jpg");
    } catch (const Error&) {
      ++num_found;
    }
  }
  EXPECT_GT(num_lost, 40);
  EXPECT_GT(num_found, 9 * num_lost / 10);
}

TEST(JpegDecoder, TakesAFewBytesBeforeARestartMarkerAndNotMany) {
  const std::string bytes = JpegBytes({.restart_rows = 1});
  const std::size_t restart = bytes.find("\xFF\xD1");
  ASSERT_NE(restart, std::string::npos);
  std::string few = bytes;
  few.insert(restart, 4, '\0');
  EXPECT_EQ(cv::norm(DecodeJpeg(few, "image.jpg"), JpegByOpenCv(bytes), cv::NORM_INF), 0);
  std::string many = bytes;
  many.insert(restart, 40, '\0');
  EXPECT_THAT([&] { DecodeJpeg(many, "image.jpg"); }, SaysDamaged());
}

// As phones write them: "invalid SOS parameters for sequential JPEG".
TEST(JpegDecoder, TakesNumbersWithoutAMeaning) {
  const std::string bytes = JpegBytes({});
  std::string odd = bytes;
  odd[ScanBegin(bytes) - 2] = '\0';  // the last coefficient, of files that are not progressive 63
  EXPECT_EQ(cv::norm(DecodeJpeg(odd, "image.jpg"), JpegByOpenCv(bytes), cv::NORM_INF), 0);
}

TEST(JpegDecoder, RefusesWhatSaysItIsHuge) {
  std::string bytes = JpegBytes({});
  bytes.replace(bytes.find("\xFF\xC0") + 5, 4, "\x75\x30\x75\x30");  // 30000
  EXPECT_THAT([&] { DecodeJpeg(bytes, "image.jpg"); },
              ThrowsMessage<Error>(HasSubstr("the image is too large (expected at most 268435456 "
                                             "pixels, found 30000x30000)")));
}

// Each scan makes the whole image once more.
TEST(JpegDecoder, RefusesAnImageThatIsRefinedEndlessly) {
  const std::string bytes = JpegBytes({.is_progressive = true}, 16, 16);
  // The last scan, which refines one bit, again and again.
  const std::size_t last = bytes.rfind("\xFF\xDA");
  std::string endless = bytes.substr(0, bytes.size() - 2);
  for (int i = 0; i < 600; ++i) endless += bytes.substr(last, bytes.size() - 2 - last);
  EXPECT_THROW(DecodeJpeg(endless + "\xFF\xD9", "image.jpg"), Error);
}

TEST(JpegDecoder, RefusesWhatItCannotDecode) {
  EXPECT_THAT([&] { DecodeJpeg("\xFF\xD8 and no more", "image.jpg"); },
              ThrowsMessage<Error>(HasSubstr("image.jpg: ")));
  EXPECT_THROW(DecodeJpeg("", "image.jpg"), Error);
  std::string of_12_bits = JpegBytes({});
  of_12_bits[of_12_bits.find("\xFF\xC0") + 4] = 12;
  EXPECT_THAT([&] { DecodeJpeg(of_12_bits, "image.jpg"); },
              ThrowsMessage<Error>(HasSubstr("cannot decode the image (found Unsupported JPEG data "
                                             "precision 12)")));
}

}  // namespace
}  // namespace mono3d
