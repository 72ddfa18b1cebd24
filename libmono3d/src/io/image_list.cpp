// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_list.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

constexpr std::array<std::string_view, 9> kImageExtensions = {
    ".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm"};

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

// What is named as an image counts in the numbers of the frames that are given to it.
bool IsFileOrWarn(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) return true;
  static std::mutex mutex;
  static std::set<std::filesystem::path> warned_of;  // once: a folder is listed several times
  const std::lock_guard lock(mutex);
  if (!warned_of.insert(path).second) return false;
  const bool is_folder = std::filesystem::is_directory(path, ignored);
  Log(LogLevel::kWarning, path.string() + ": left out, and not counted among the frames: " +
                              (is_folder ? "a folder" : "a link to nothing, or no file"));
  return false;
}

bool IsImage(const std::filesystem::path& path) {
  // Hidden files are not the user's: "._img1.jpg" is what macOS leaves on memory cards.
  return !path.filename().string().starts_with('.') && HasImageExtension(path) &&
         IsFileOrWarn(path);
}

std::vector<std::string> ImagesInFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::string> images;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (IsImage(it->path())) images.push_back(it->path());
  }
  if (error) {
    throw Error(ErrorParts{.what = "cannot read the folder: " + error.message(),
                           .where = folder,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kIo});
  }
  return images;
}

std::vector<std::string> ImagesOfGlob(const std::string& pattern) {
  glob_t matches{};
  const int result = glob(pattern.c_str(), 0, nullptr, &matches);
  const std::unique_ptr<glob_t, decltype(&globfree)> guard(&matches, globfree);
  std::vector<std::string> images;
  if (result != 0) return images;
  std::copy_if(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc, std::back_inserter(images),
               [](const char* path) { return IsImage(path); });
  return images;
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

bool IsGlob(std::string_view input) {
  std::error_code ignored;
  return input.find_first_of("*?[") != std::string_view::npos &&
         !std::filesystem::exists(input, ignored);
}

InputKind KindOfInput(const std::string& input) {
  std::error_code ignored;
  if (std::filesystem::is_directory(input, ignored) || IsGlob(input)) return InputKind::kImages;
  if (!std::filesystem::exists(input, ignored)) {
    throw Error(ErrorParts{.what = "there is no such file or folder",
                           .where = input,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kNotFound});
  }
  if (!std::filesystem::is_regular_file(input, ignored)) {
    throw Error(ErrorParts{.what = "neither a file nor a folder: pipes and devices are not read",
                           .where = input,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kUnsupported});
  }
  return HasImageExtension(input) ? InputKind::kImage : InputKind::kVideo;
}

std::vector<std::string> ListImages(const std::string& input) {
  const bool is_glob = IsGlob(input);
  std::error_code ignored;
  if (!is_glob && !std::filesystem::is_directory(input, ignored)) {
    throw Error(ErrorParts{.what = "there is no such folder",
                           .where = input,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kNotFound});
  }
  std::vector<std::string> images =
      is_glob ? ImagesOfGlob(input) : ImagesInFolder(ImageFolder(input));
  if (images.empty()) {
    throw Error(ErrorParts{
        .what = is_glob ? "no image matches the pattern" : "there are no images in the folder",
        .where = input,
        .expected = "files named .jpg .jpeg .png .bmp .tif .tiff .webp .pgm or .ppm",
        .found = {},
        .code = ErrorCode::kNotFound});
  }
  std::sort(images.begin(), images.end(), NaturalLess);
  return images;
}

}  // namespace mono3d
