// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_metadata.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <istream>
#include <limits>
#include <string_view>
#include <system_error>

#include "io/heif_file.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kJpegSignature = "\xFF\xD8"sv;
constexpr std::string_view kTiffLittleEndian = "II*\0"sv;
constexpr std::string_view kTiffBigEndian = "MM\0*"sv;
constexpr std::string_view kExifHeader = "Exif\0\0"sv;
constexpr std::string_view kXmpHeader = "http://ns.adobe.com/xap/1.0/\0"sv;

// The next bytes of the file; fewer at its end.
std::string TakeBytes(std::istream& file, std::size_t num_bytes) {
  std::string bytes(num_bytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(num_bytes));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

int BigEndianNumber(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<std::uint8_t>(byte);
  return value > INT32_MAX ? 0 : static_cast<int>(value);
}

// Of a JPEG segment, behind the bytes of its length.
void ReadSegment(int marker, std::string_view content, ImageMetadata& metadata) {
  const bool is_frame_header =  // SOF0 to SOF15, without DHT, JPG and DAC (ITU-T T.81, table B.1)
      marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
  if (is_frame_header && content.size() >= 5) {
    metadata.height = BigEndianNumber(content.substr(1, 2));
    metadata.width = BigEndianNumber(content.substr(3, 2));
  } else if (content.starts_with(kExifHeader) && metadata.exif.empty()) {
    metadata.exif = content;
  } else if (content.starts_with(kXmpHeader) && metadata.xmp.empty()) {
    metadata.xmp = content.substr(kXmpHeader.size());
  }
}

// Segment by segment to the coded pixels, or to what is no segment.
void ReadJpegHead(std::istream& file, ImageMetadata& metadata) {
  constexpr int kEndOfImage = 0xD9;
  constexpr int kStartOfScan = 0xDA;
  constexpr int kApp1 = 0xE1;
  for (int byte = file.get(); byte >= 0; byte = file.get()) {
    if (byte != 0xFF) continue;  // between two segments: decoders pass over it
    int marker = file.get();
    while (marker == 0xFF) marker = file.get();  // fill bytes
    if (marker < 0 || marker == kEndOfImage || marker == kStartOfScan) return;
    if (marker == 0) continue;
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;  // without a length
    const int length = BigEndianNumber(TakeBytes(file, 2));              // counts itself
    if (length < 2) return;
    const bool is_frame_header = marker >= 0xC0 && marker <= 0xCF;
    if (marker == kApp1 || is_frame_header) {
      ReadSegment(marker, TakeBytes(file, static_cast<std::size_t>(length) - 2), metadata);
    } else {
      file.seekg(length - 2, std::ios::cur);
    }
  }
}

int LittleEndianNumber(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    value |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[i])) << 8 * i;
  }
  // A BMP whose top row comes first has a negative height.
  return static_cast<int>(value > INT32_MAX ? std::min<std::uint32_t>(0U - value, INT32_MAX)
                                            : value);
}

// "P6 # comment\n640 480 255": the numbers, between blanks and comments.
void ReadPnmSize(std::istream& file, ImageMetadata& metadata) {
  for (int* size : {&metadata.width, &metadata.height}) {
    while (file >> std::ws && file.peek() == '#') {
      file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    if (!(file >> *size)) *size = 0;
    file.get();  // one byte of any kind ends a number, for OpenCV
  }
}

// Of one of the three kinds of WebP (RFC 9649), whose first chunk begins at the twelfth byte.
void ReadWebpSize(std::string_view head, ImageMetadata& metadata) {
  const std::string_view kind = head.substr(12, 4);
  if (kind == "VP8X"sv) {
    metadata.width = LittleEndianNumber(head.substr(24, 3)) + 1;
    metadata.height = LittleEndianNumber(head.substr(27, 3)) + 1;
  } else if (kind == "VP8L"sv) {
    // 14 bits each, one behind the other.
    metadata.width = (LittleEndianNumber(head.substr(21, 2)) & 0x3FFF) + 1;
    metadata.height = (LittleEndianNumber(head.substr(22, 3)) >> 6 & 0x3FFF) + 1;
  } else if (kind == "VP8 "sv) {
    metadata.width = LittleEndianNumber(head.substr(26, 2)) & 0x3FFF;
    metadata.height = LittleEndianNumber(head.substr(28, 2)) & 0x3FFF;
  }
}

void ReadHeif(const std::string& bytes, ImageMetadata& metadata) {
  const HeifFile file = OpenHeif(bytes);
  if (!file.primary) return;
  metadata.width = heif_image_handle_get_ispe_width(file.primary.get());
  metadata.height = heif_image_handle_get_ispe_height(file.primary.get());
  metadata.exif = ExifOf(file);
  metadata.xmp = XmpOf(file);
}

}  // namespace

ImageMetadata ReadImageMetadata(const std::filesystem::path& path) {
  ImageMetadata metadata;
  std::error_code ignored;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
  if (!file.is_open()) {
    ReadBytes(path);  // says why it cannot be read
    return metadata;
  }
  constexpr std::size_t kPngSizeEnd = 24;  // signature, length and type of the chunk IHDR, 8 bytes
  const std::string head = TakeBytes(file, kPngSizeEnd);
  if (head.starts_with(kJpegSignature)) {
    file.clear();
    file.seekg(kJpegSignature.size());
    ReadJpegHead(file, metadata);
  } else if (head.starts_with(kPngSignature) && head.size() == kPngSizeEnd) {
    metadata.width = BigEndianNumber(std::string_view(head).substr(16, 4));
    metadata.height = BigEndianNumber(std::string_view(head).substr(20, 4));
  } else if (head.starts_with(kTiffLittleEndian) || head.starts_with(kTiffBigEndian)) {
    metadata.exif = std::string(kExifHeader) + ReadBytes(path);
  } else if (head.starts_with("BM") && head.size() == kPngSizeEnd) {
    // The file of an OS/2 of long ago has 16 bits for each.
    const bool is_old = LittleEndianNumber(std::string_view(head).substr(14, 4)) == 12;
    const std::size_t num_bytes = is_old ? 2 : 4;
    file.seekg(18);
    metadata.width = LittleEndianNumber(TakeBytes(file, num_bytes));
    metadata.height = LittleEndianNumber(TakeBytes(file, num_bytes));
  } else if (head.starts_with("RIFF") && head.size() == kPngSizeEnd &&
             head.substr(8, 4) == "WEBP") {
    constexpr std::size_t kWebpSizeEnd = 30;
    const std::string whole_head = head + TakeBytes(file, kWebpSizeEnd - head.size());
    if (whole_head.size() == kWebpSizeEnd) ReadWebpSize(whole_head, metadata);
  } else if (IsHeif(head)) {
    ReadHeif(ReadBytes(path), metadata);
  } else if (head.size() > 2 && head[0] == 'P' && head[1] >= '1' && head[1] <= '6') {
    file.clear();
    file.seekg(2);
    ReadPnmSize(file, metadata);
  }
  return metadata;
}

void RequireDecodableSize(std::int64_t width, std::int64_t height,
                          const std::filesystem::path& path) {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;  // 805 MB in three bytes a pixel
  if (width <= 0 || height <= 0) {
    throw Error(ErrorParts{.what = "the image does not say its size: it is damaged",
                           .where = path,
                           .expected = {},
                           .found = {}});
  }
  if (width <= kMaxPixels / height) return;
  throw Error(ErrorParts{.what = "the image is too large",
                         .where = path,
                         .expected = "at most " + std::to_string(kMaxPixels) + " pixels",
                         .found = std::to_string(width) + "x" + std::to_string(height),
                         .code = ErrorCode::kUnsupported});
}

}  // namespace mono3d
