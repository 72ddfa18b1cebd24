// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/heif_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace mono3d {
namespace {

// The first block of metadata of this type, "Exif" or "mime".
std::string BlockOf(const heif_image_handle* image, const char* type) {
  heif_item_id id = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(image, type, &id, 1) != 1) return {};
  constexpr std::size_t kMostBytes = std::size_t{1} << 24;
  const std::size_t size = heif_image_handle_get_metadata_size(image, id);
  if (size == 0 || size > kMostBytes) return {};
  std::string block(size, '\0');
  if (heif_image_handle_get_metadata(image, id, block.data()).code != heif_error_Ok) return {};
  return block;
}

}  // namespace

bool IsHeif(std::string_view bytes) {
  constexpr std::array<std::string_view, 9> kBrands = {"heic", "heix", "heim", "heis", "hevc",
                                                       "hevx", "mif1", "msf1", "avif"};
  return bytes.size() >= 12 && bytes.substr(4, 4) == "ftyp" &&
         std::ranges::find(kBrands, bytes.substr(8, 4)) != kBrands.end();
}

HeifFile OpenHeif(std::string_view bytes) {
  HeifFile file;
  file.context.reset(heif_context_alloc());
  file.error = heif_context_read_from_memory_without_copy(file.context.get(), bytes.data(),
                                                          bytes.size(), nullptr);
  if (file.error.code != heif_error_Ok) return file;
  heif_image_handle* primary = nullptr;
  file.error = heif_context_get_primary_image_handle(file.context.get(), &primary);
  file.primary.reset(primary);
  return file;
}

// Before it four bytes say where the TIFF header begins behind them.
std::string ExifOf(const HeifFile& file) {
  const std::string block = BlockOf(file.primary.get(), "Exif");
  constexpr std::size_t kOffsetSize = 4;
  if (block.size() < kOffsetSize) return {};
  std::size_t offset = kOffsetSize;
  for (std::size_t i = 0; i < kOffsetSize; ++i) {
    offset += static_cast<std::size_t>(static_cast<std::uint8_t>(block[i])) << (24 - 8 * i);
  }
  if (offset >= block.size()) return {};
  return std::string("Exif\0\0", 6) + block.substr(offset);
}

std::string XmpOf(const HeifFile& file) {
  std::string document = BlockOf(file.primary.get(), "mime");
  return document.find("xmpmeta") != std::string::npos ? document : std::string{};
}

}  // namespace mono3d
