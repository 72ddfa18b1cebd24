// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>

#include "io/exif_camera.h"
#include "io/heif_decoder.h"
#include "io/heif_file.h"
#include "io/image_metadata.h"
#include "io/jpeg_decoder.h"
#include "io/png_decoder.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::string_view kJpegBegin = "\xFF\xD8";

std::uint32_t BigEndian(std::string_view bytes, std::size_t position, std::size_t num_bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < num_bytes; ++i) {
    value = value << 8 | static_cast<std::uint8_t>(bytes[position + i]);
  }
  return value;
}

// Does the JPEG go on to its end-of-image marker (ITU-T T.81, annex B)? The marker may also stand
// in an embedded thumbnail, so segments are walked by their length. What follows the marker is of
// no interest: cameras append previews and maker notes.
bool IsCompleteJpeg(std::string_view bytes) {
  constexpr std::uint32_t kEndOfImage = 0xD9;
  std::size_t position = kJpegBegin.size();
  while (position + 1 < bytes.size()) {
    const std::uint32_t marker = BigEndian(bytes, position + 1, 1);
    const bool is_marker = bytes[position] == '\xFF' && marker != 0x00 && marker != 0xFF;
    const bool is_restart = marker >= 0xD0 && marker <= 0xD7;
    if (!is_marker) {
      ++position;  // inside coded data, or a fill byte
    } else if (is_restart) {
      position += 2;
    } else if (marker == kEndOfImage) {
      return true;
    } else {
      if (position + 3 >= bytes.size()) return false;
      position += 2 + BigEndian(bytes, position + 2, 2);
    }
  }
  return false;
}

[[noreturn]] void ThrowUnreadable(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorParts{.what = what, .where = path, .expected = {}, .found = {}});
}

// Decoders of further forms, which nobody asked for, need not be trusted.
bool IsOfKnownForm(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr std::array<std::string_view, 5> kSignatures = {kJpegBegin, kPngSignature, "BM"sv,
                                                           "II*\0"sv, "MM\0*"sv};
  const auto begins = [&](std::string_view signature) { return bytes.starts_with(signature); };
  if (std::ranges::any_of(kSignatures, begins)) return true;
  if (IsHeif(bytes)) return true;
  if (bytes.starts_with("RIFF")) return bytes.substr(0, 12).ends_with("WEBP");
  return bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6';
}

}  // namespace

void RequireDecodableSize(const std::filesystem::path& path) {
  ImageMetadata metadata = ReadImageMetadata(path);
  if (metadata.width <= 0 && !metadata.exif.empty()) {  // of a TIFF file
    const ExifCamera exif = ParseExif(metadata.exif);
    metadata.width = exif.stored_width;
    metadata.height = exif.stored_height;
  }
  // Where it says none, a decoder may find another way to one.
  RequireDecodableSize(metadata.width, metadata.height, path);
}

namespace {

// The forms that hold more than 8 bits in a value.
bool MayHave16Bits(std::string_view bytes) {
  constexpr std::size_t kBitDepth = 24;  // in the chunk IHDR
  if (bytes.starts_with(kPngSignature)) return bytes.size() > kBitDepth && bytes[kBitDepth] == 16;
  const bool is_tiff = bytes.starts_with("II*") || bytes.starts_with("MM");
  return is_tiff || bytes.starts_with("P5") || bytes.starts_with("P6");
}

bool FileMayHave16Bits(const std::string& path) {
  std::array<char, 32> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  return MayHave16Bits(std::string_view(head.data(), static_cast<std::size_t>(file.gcount())));
}

// Of an image that is whole and may be decoded.
std::string ReadWholeImage(const std::filesystem::path& path) {
  std::string bytes = ReadBytes(path);
  if (bytes.empty()) ThrowUnreadable(path, "the file is empty");
  if (bytes.size() > INT32_MAX) ThrowUnreadable(path, "the file is too large for an image");
  const bool is_cut_jpeg = bytes.starts_with(kJpegBegin) && !IsCompleteJpeg(bytes);
  const bool is_cut_png = bytes.starts_with(kPngSignature) && !IsCompletePng(bytes);
  if (is_cut_jpeg || is_cut_png) ThrowUnreadable(path, "the image is truncated: copy it again");
  if (!IsOfKnownForm(bytes)) ThrowUnreadable(path, "not an image, or not of a known kind");
  RequireDecodableSize(path);
  return bytes;
}

// Of the other forms.
cv::Mat DecodeByOpenCv(const std::string& bytes, const std::filesystem::path& path, int flags) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  cv::Mat image = cv::imdecode(cv::_InputArray(data, static_cast<int>(bytes.size())),
                               flags | cv::IMREAD_IGNORE_ORIENTATION);
  if (image.empty()) ThrowUnreadable(path, "cannot decode the image");
  return image;
}

// Runs `decode`, whose cv::Exception of an image becomes an Error.
template <typename Decode>
cv::Mat DecodeOrThrow(const std::filesystem::path& path, const Decode& decode) {
  try {
    return decode();
  } catch (const cv::Exception& exception) {
    ThrowUnreadable(path, "cannot decode the image: " + exception.err);
  }
}

// As it is stored, 8 or 16 bits in each of three channels.
cv::Mat Decode(const std::filesystem::path& path) {
  const std::string bytes = ReadWholeImage(path);
  return DecodeOrThrow(path, [&] {
    if (bytes.starts_with(kJpegBegin)) return DecodeJpeg(bytes, path);
    if (bytes.starts_with(kPngSignature)) return DecodePng(bytes, path, PngValues::kColour);
    if (IsHeif(bytes)) return DecodeHeif(bytes, path);
    const int any_depth = MayHave16Bits(bytes) ? cv::IMREAD_ANYDEPTH : 0;
    cv::Mat image = DecodeByOpenCv(bytes, path, cv::IMREAD_COLOR | any_depth);
    if (image.depth() != CV_8U && image.depth() != CV_16U) {
      image = DecodeByOpenCv(bytes, path, cv::IMREAD_COLOR);
    }
    return image;
  });
}

cv::Mat UpperBits(const cv::Mat& image, int value_bits) {
  const int shift = value_bits - 8;
  cv::Mat upper(image.size(), CV_8UC(image.channels()));
  for (int y = 0; y < image.rows; ++y) {
    const auto* from = image.ptr<std::uint16_t>(y);
    std::transform(
        from, from + image.cols * image.channels(), upper.ptr<std::uint8_t>(y),
        [shift](int value) { return static_cast<std::uint8_t>(std::min(255, value >> shift)); });
  }
  return upper;
}

}  // namespace

bool IsCompletePng(std::string_view bytes) {
  constexpr std::size_t kAroundData = 12;  // length, type, checksum
  std::size_t position = kPngSignature.size();
  while (position + kAroundData <= bytes.size()) {
    const std::string_view type = bytes.substr(position + 4, 4);
    position += kAroundData + BigEndian(bytes, position, 4);
    if (type == "IEND") return position <= bytes.size();
  }
  return false;
}

cv::Mat ReadImage(const std::filesystem::path& path, int value_bits) {
  const cv::Mat image = Decode(path);
  return image.depth() == CV_16U ? UpperBits(image, value_bits) : image;
}

cv::Mat ReadSmallImage(const std::filesystem::path& path) {
  const std::string bytes = ReadWholeImage(path);
  return DecodeOrThrow(path, [&] {
    constexpr int kReduction = 8;
    if (bytes.starts_with(kJpegBegin)) return DecodeJpeg(bytes, path, kReduction);
    const bool is_heif = IsHeif(bytes);
    if (!is_heif && !bytes.starts_with(kPngSignature)) {
      return DecodeByOpenCv(bytes, path, cv::IMREAD_REDUCED_COLOR_8);
    }
    const cv::Mat image =
        is_heif ? DecodeHeif(bytes, path) : DecodePng(bytes, path, PngValues::kColour8);
    cv::Mat small;
    const cv::Size size(std::max(1, image.cols / kReduction), std::max(1, image.rows / kReduction));
    cv::resize(image, small, size, 0, 0, cv::INTER_LINEAR_EXACT);
    return small;
  });
}

int FindValueBits(const std::vector<std::string>& images) {
  constexpr std::size_t kMostRead = 5;
  constexpr int kMostEmptied = 14;  // with 15 bits, all but one of the upper 8 are there
  constexpr int kAll = 16;
  double largest = 0;
  const std::size_t stride = std::max<std::size_t>(1, images.size() / kMostRead);
  for (std::size_t i = 0; i < images.size(); i += stride) {
    if (!FileMayHave16Bits(images[i])) return kAll;
    try {
      const cv::Mat image = Decode(images[i]);
      if (image.depth() != CV_16U) return kAll;
      double largest_of_image = 0;
      cv::minMaxLoc(image.reshape(1), nullptr, &largest_of_image);
      largest = std::max(largest, largest_of_image);
    } catch (const Error&) {
      continue;
    }
  }
  const int bits = std::bit_width(static_cast<unsigned>(largest));
  return largest == 0 || bits > kMostEmptied ? kAll : std::max(8, bits);
}

}  // namespace mono3d
