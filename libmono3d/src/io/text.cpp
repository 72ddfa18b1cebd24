// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <ios>
#include <system_error>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";

template <typename Number>
std::optional<Number> Parse(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

}  // namespace

std::string ReadBytes(const std::filesystem::path& path) {
  constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
  const auto refuse = [&](const char* what, ErrorCode code) {
    throw Error(ErrorParts{.what = what, .where = path, .expected = {}, .found = {}, .code = code});
  };
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    refuse("there is no such file", ErrorCode::kNotFound);
  // A pipe may never end, nor a device.
  if (!std::filesystem::is_regular_file(path, ignored)) {
    refuse(std::filesystem::is_directory(path, ignored) ? "cannot read the file: it is a folder"
                                                        : "cannot read the file: not a regular one",
           ErrorCode::kIo);
  }
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) {
    refuse("cannot read the file", ErrorCode::kIo);
  }
  std::string bytes;
  std::streamsize num_read = 0;
  do {
    const std::size_t size = bytes.size();
    bytes.resize(size + kBlockBytes);
    file.read(bytes.data() + size, kBlockBytes);
    num_read = file.gcount();
    bytes.resize(size + static_cast<std::size_t>(num_read));
  } while (num_read > 0);
  if (file.bad()) refuse("cannot read the file", ErrorCode::kIo);
  return bytes;
}

std::vector<std::string> ReadLines(const std::filesystem::path& path) {
  const std::string bytes = ReadBytes(path);
  std::string_view text = bytes;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.emplace_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string AtLine(const std::filesystem::path& path, std::size_t line_number) {
  return path.string() + ":" + std::to_string(line_number);
}

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t length = std::min(line.find_first_of(kBlanks), line.size());
    words.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
}

std::optional<double> ParseNumber(std::string_view text) {
  const std::optional<double> number = Parse<double>(text);
  if (!number || !std::isfinite(*number)) return std::nullopt;
  return number;
}

std::optional<std::int64_t> ParseInteger(std::string_view text) {
  return Parse<std::int64_t>(text);
}

std::string ToText(double number) {
  char buffer[32];  // the longest shortest form has 24 characters
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, number);
  return {buffer, end};
}

}  // namespace mono3d
