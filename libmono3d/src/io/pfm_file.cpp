// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/pfm_file.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

static_assert(std::endian::native == std::endian::little, "PFM rows are written as they are");

[[noreturn]] void ThrowBadPfm(const std::filesystem::path& path, const std::string& what,
                              const std::string& expected, const std::string& found) {
  throw Error(ErrorParts{.what = what, .where = path, .expected = expected, .found = found});
}

struct Header {
  int num_channels = 0;
  int width = 0;
  int height = 0;
  bool is_little_endian = true;
  std::size_t num_bytes = 0;  // of the header
};

// The next word of the header. Exactly one blank stands between the last one and the data.
std::string TakeWord(std::string_view bytes, std::size_t& position) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
  while (position < bytes.size() && is_blank(bytes[position])) ++position;
  const std::size_t begin = position;
  while (position < bytes.size() && !is_blank(bytes[position])) ++position;
  constexpr std::size_t kMaxWord = 32;  // a file of another kind may have no blank for long
  return std::string(bytes.substr(begin, std::min(position - begin, kMaxWord)));
}

Header ParseHeader(const std::filesystem::path& path, std::string_view bytes) {
  if (!bytes.starts_with("Pf") && !bytes.starts_with("PF")) {
    ThrowBadPfm(path, "not a PFM file", "Pf or PF at the beginning", {});
  }
  Header header;
  std::size_t position = 0;
  header.num_channels = TakeWord(bytes, position) == "PF" ? 3 : 1;
  for (int* size : {&header.width, &header.height}) {
    const std::string word = TakeWord(bytes, position);
    const std::optional<std::int64_t> value = ParseInteger(word);
    if (!value || *value < 1 || *value > std::numeric_limits<std::int16_t>::max()) {
      ThrowBadPfm(path, "bad image size in the header", "1 to 32767", word);
    }
    *size = static_cast<int>(*value);
  }
  const std::string word = TakeWord(bytes, position);
  const std::optional<double> scale = ParseNumber(word);
  if (!scale || *scale == 0) ThrowBadPfm(path, "bad scale in the header", "a number", word);
  header.is_little_endian = *scale < 0;
  header.num_bytes = position + 1;
  return header;
}

void SwapBytes(cv::Mat& image) {
  auto* values = image.ptr<std::uint32_t>();
  const std::size_t num_values = image.total() * static_cast<std::size_t>(image.channels());
  std::for_each(values, values + num_values,
                [](std::uint32_t& value) { value = __builtin_bswap32(value); });
}

}  // namespace

// Not by cv::imread: OpenCV 4.6 divides the values by the magnitude of the header's scale, of which
// files from elsewhere have any; exchanges the first and third channel, which are x and z of
// normals here; and refuses lines that end with a carriage return. The checks of the header, which
// are most of this file, would be needed before it all the same.
cv::Mat ReadPfm(const std::filesystem::path& path) {
  const std::string bytes = ReadBytes(path);
  const Header header = ParseHeader(path, bytes);
  const std::size_t row_bytes =
      static_cast<std::size_t>(header.width * header.num_channels) * sizeof(float);
  const std::size_t needed = header.num_bytes + row_bytes * static_cast<std::size_t>(header.height);
  if (bytes.size() < needed) {
    ThrowBadPfm(path, "file ends too early", std::to_string(needed) + " bytes",
                std::to_string(bytes.size()));
  }
  // Not before: a few bytes may speak of 12 GB.
  cv::Mat image(header.height, header.width, CV_32FC(header.num_channels));
  const char* row = bytes.data() + header.num_bytes;
  for (int y = image.rows - 1; y >= 0; --y, row += row_bytes) {
    std::memcpy(image.ptr(y), row, row_bytes);
  }
  if (!header.is_little_endian) SwapBytes(image);
  return image;
}

void WritePfm(const std::filesystem::path& path, const cv::Mat& image) {
  if (image.empty() || (image.type() != CV_32FC1 && image.type() != CV_32FC3)) {
    ThrowBadPfm(path, "cannot be written as PFM", "a CV_32FC1 or CV_32FC3 image",
                image.empty() ? "an empty image" : cv::typeToString(image.type()));
  }
  AtomicFile file(path);
  file.Write(image.channels() == 3 ? "PF\n" : "Pf\n");
  file.Write(std::to_string(image.cols) + " " + std::to_string(image.rows) + "\n-1.0\n");
  const std::size_t row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
  for (int y = image.rows - 1; y >= 0; --y) file.Write({image.ptr<char>(y), row_bytes});
  file.Commit(Durability::kInCache);  // a run writes thousands
}

}  // namespace mono3d
