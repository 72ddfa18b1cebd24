// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <system_error>

namespace mono3d {
namespace {

constexpr std::array<std::string_view, 13> kImageExtensions = {
    ".jpg",  ".jpeg", ".png", ".bmp",  ".tif", ".tiff", ".webp",
    ".heic", ".heif", ".hif", ".avif", ".pgm", ".ppm"};

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Takes the run of digits at the front of `text`, without leading zeros.
std::string_view TakeNumber(std::string_view& text) {
  std::size_t length = 0;
  while (length < text.size() && IsDigit(text[length])) ++length;
  std::string_view number = text.substr(0, length);
  text.remove_prefix(length);
  while (number.size() > 1 && number.front() == '0') number.remove_prefix(1);
  return number;
}

}  // namespace

bool NaturalLess(std::string_view a, std::string_view b) {
  std::string_view rest_a = a;
  std::string_view rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    if (IsDigit(rest_a.front()) && IsDigit(rest_b.front())) {
      const std::string_view number_a = TakeNumber(rest_a);
      const std::string_view number_b = TakeNumber(rest_b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
    } else {
      if (rest_a.front() != rest_b.front()) return rest_a.front() < rest_b.front();
      rest_a.remove_prefix(1);
      rest_b.remove_prefix(1);
    }
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a < b;
}

bool HasImageExtension(const std::filesystem::path& path) {
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kImageExtensions.begin(), kImageExtensions.end(), extension) !=
         kImageExtensions.end();
}

std::filesystem::path ImageFolder(const std::filesystem::path& folder) {
  std::error_code ignored;
  const std::filesystem::path inner = folder / "images";
  return std::filesystem::is_directory(inner, ignored) ? inner : folder;
}

}  // namespace mono3d
