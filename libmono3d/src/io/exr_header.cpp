// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/exr_header.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Source of the layout: https://openexr.com/en/latest/OpenEXRFileLayout.html

struct TypeSize {
  std::string_view type;
  std::size_t bytes;
};
// OpenEXR reads values of these types without regard to the size that the file tells, so that
// another size would make it take values for names from there on.
constexpr std::array kTypeSizes = {
    TypeSize{"box2i", 16}, TypeSize{"box2f", 16},      TypeSize{"chromaticities", 32},
    TypeSize{"int", 4},    TypeSize{"compression", 1}, TypeSize{"deepImageState", 1},
    TypeSize{"double", 8}, TypeSize{"envmap", 1},      TypeSize{"float", 4},
    TypeSize{"v2i", 8},    TypeSize{"keycode", 28},    TypeSize{"lineOrder", 1},
    TypeSize{"m33f", 36},  TypeSize{"m33d", 72},       TypeSize{"m44f", 64},
    TypeSize{"m44d", 128}, TypeSize{"rational", 8},    TypeSize{"tiledesc", 9},
    TypeSize{"v2f", 8},    TypeSize{"v2d", 16},        TypeSize{"v3i", 12},
    TypeSize{"v3f", 12},   TypeSize{"v3d", 24},        TypeSize{"timecode", 8}};

// Reads on in bytes; nothing where they end before.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  bool IsAtEnd() const { return bytes_.empty(); }
  bool Skip(std::size_t count) {
    if (count > bytes_.size()) return false;
    bytes_.remove_prefix(count);
    return true;
  }
  std::optional<std::string_view> Take(std::size_t count) {
    const std::string_view taken = bytes_.substr(0, count);
    return Skip(count) ? std::optional(taken) : std::nullopt;
  }
  // Without the zero behind it. OpenEXR reads at most 255 characters.
  std::optional<std::string_view> Name() {
    constexpr std::size_t kMaxLength = 255;
    const std::size_t length = bytes_.substr(0, kMaxLength + 1).find('\0');
    if (length == std::string_view::npos) return std::nullopt;
    const std::string_view name = bytes_.substr(0, length);
    Skip(length + 1);
    return name;
  }
  std::optional<std::int32_t> Int() {
    std::int32_t value = 0;
    const auto taken = Take(sizeof value);
    if (!taken) return std::nullopt;
    std::memcpy(&value, taken->data(), sizeof value);
    return value;
  }

 private:
  std::string_view bytes_;
};

struct ExrHeader {
  std::int64_t num_channels = 0;
  std::int64_t width = 0;
  std::int64_t height = 0;
  int compression = 0;
  std::int64_t tile_pixels = 0;
  bool is_empty = true;
};

// Nothing where the list does not end with the attribute.
std::optional<std::int64_t> NumChannels(std::string_view value) {
  constexpr std::size_t kChannelBytes = 16;  // type, linearity, samplings
  Reader reader(value);
  for (std::int64_t count = 0;; ++count) {
    const auto name = reader.Name();
    if (!name) return std::nullopt;
    if (name->empty()) return reader.IsAtEnd() ? std::optional(count) : std::nullopt;
    if (!reader.Skip(kChannelBytes)) return std::nullopt;
  }
}

bool AreStringsWithin(std::string_view value) {
  Reader reader(value);
  while (!reader.IsAtEnd()) {
    const auto length = reader.Int();
    if (!length || *length < 0 || !reader.Skip(static_cast<std::size_t>(*length))) return false;
  }
  return true;
}

bool IsPreviewWithin(std::string_view value) {
  Reader reader(value);
  const auto width = reader.Int();
  const auto height = reader.Int();
  if (!width || !height || *width < 0 || *height < 0) return false;
  constexpr std::size_t kSizes = 8;  // bytes of width and height
  const auto pixels = static_cast<std::uint64_t>(*width) * static_cast<std::uint64_t>(*height);
  return (value.size() - kSizes) % 4 == 0 && pixels == (value.size() - kSizes) / 4;
}

bool IsSound(std::string_view type, std::string_view value) {
  for (const TypeSize& known : kTypeSizes) {
    if (type == known.type) return value.size() == known.bytes;
  }
  if (type == "stringvector") return AreStringsWithin(value);
  if (type == "preview") return IsPreviewWithin(value);
  return true;  // read by their size
}

// False for a value that OpenEXR would not take from the attribute as it is.
bool Note(std::string_view name, std::string_view type, std::string_view value, ExrHeader& header) {
  Reader reader(value);
  if (type == "chlist") {
    const auto count = NumChannels(value);
    header.num_channels = std::max(header.num_channels, count.value_or(0));
    return count.has_value();
  }
  if (!IsSound(type, value)) return false;
  if (name == "dataWindow" && type == "box2i") {
    const std::int64_t left = *reader.Int();
    const std::int64_t top = *reader.Int();
    header.width = *reader.Int() - left + 1;
    header.height = *reader.Int() - top + 1;
  } else if (name == "compression" && type == "compression") {
    header.compression = static_cast<unsigned char>(value.front());
  } else if (name == "tiles" && type == "tiledesc") {
    const std::int64_t width = *reader.Int();
    const std::int64_t height = *reader.Int();
    constexpr std::int64_t kMaxSide = std::numeric_limits<std::int16_t>::max();
    if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) return false;
    header.tile_pixels = width * height;
  }
  return true;
}

std::optional<ExrHeader> ReadHeader(Reader& reader) {
  ExrHeader header;
  while (true) {
    const auto name = reader.Name();
    if (!name) return std::nullopt;
    if (name->empty()) return header;
    header.is_empty = false;
    const auto type = reader.Name();
    const auto size = reader.Int();
    if (!type || !size || *size < 0) return std::nullopt;
    const auto value = reader.Take(static_cast<std::size_t>(*size));
    if (!value || !Note(*name, *type, *value, header)) return std::nullopt;
  }
}

// Lines that OpenEXR takes at once, by the compressions in their order in the format.
std::int64_t LinesOfBlock(int compression) {
  constexpr std::array<std::int64_t, 10> kLines = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
  return compression < static_cast<int>(kLines.size())
             ? kLines[static_cast<std::size_t>(compression)]
             : kLines.back();
}

void RequireSizes(const ExrHeader& header, const std::filesystem::path& path) {
  constexpr std::int64_t kMaxSide_px = std::numeric_limits<std::int16_t>::max();
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;  // as of other images
  const std::int64_t block_pixels =
      std::max(header.width * LinesOfBlock(header.compression), header.tile_pixels);
  if (header.width >= 1 && header.height >= 1 && header.width <= kMaxSide_px &&
      header.height <= kMaxSide_px && header.width * header.height <= kMaxPixels &&
      block_pixels * header.num_channels <= kMaxPixels) {
    return;
  }
  throw Error(ErrorParts{.what = "bad image size in the header",
                         .where = path,
                         .expected = "1 to 32767, 268 million pixels at most, in a block of lines "
                                     "of all channels as well",
                         .found = std::to_string(header.width) + "x" +
                                  std::to_string(header.height) + " in " +
                                  std::to_string(header.num_channels) + " channels"});
}

}  // namespace

void RequireSoundExrHeaders(std::string_view bytes, const std::filesystem::path& path) {
  constexpr std::int32_t kHasParts = 0x1000;  // bit of the version: an empty header ends the list
  Reader reader(bytes);
  reader.Skip(4);  // the signature
  const bool has_parts = (reader.Int().value_or(0) & kHasParts) != 0;
  while (true) {
    const auto header = ReadHeader(reader);
    if (!header) {
      throw Error(ErrorParts{.what = "the header of the OpenEXR image is damaged",
                             .where = path,
                             .expected = "attributes of their sizes within the file",
                             .found = {}});
    }
    if (has_parts && header->is_empty) return;
    RequireSizes(*header, path);
    if (!has_parts) return;
  }
}

}  // namespace mono3d
