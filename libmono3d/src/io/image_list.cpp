// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_list.h"

#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "io/input_advice.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/live_input.h"

namespace mono3d {
namespace {

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

// Beside images that are read; a folder is listed several times.
void WarnOfOtherPhotos(const std::filesystem::path& example, int num) {
  Log(LogLevel::kWarning, example.parent_path().string() + ": " + std::to_string(num) +
                              " photographs such as " + example.filename().string() +
                              " are left out: " + HowToConvert());
}

std::vector<std::string> ImagesInFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::string> images;
  std::filesystem::path other;
  int num_others = 0;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (IsImage(it->path())) images.push_back(it->path());
    if (!IsOtherPhoto(it->path()) || it->path().filename().string().starts_with('.')) continue;
    ++num_others;
    if (other.empty() || it->path() < other) other = it->path();
  }
  if (num_others > 0 && !images.empty()) WarnOfOtherPhotos(other, num_others);
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

bool IsGlob(std::string_view input) {
  std::error_code ignored;
  return input.find_first_of("*?[") != std::string_view::npos &&
         !std::filesystem::exists(input, ignored);
}

InputKind KindOfInput(const std::string& input) {
  std::error_code ignored;
  if (std::filesystem::is_directory(input, ignored) || IsGlob(input)) return InputKind::kImages;
  if (IsLiveInput(input) || !std::filesystem::exists(input, ignored)) {
    const WhatInsteadOfFile explained = ExplainNoFile(input);
    throw Error(ErrorParts{
        .what = explained.what,
        .where = WithoutPassword(input),
        .expected = explained.is_unsupported ? "" : "an image folder, a quoted glob or a video",
        .found = {},
        .code = explained.is_unsupported ? ErrorCode::kUnsupported : ErrorCode::kNotFound});
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
        .expected =
            "files named .jpg .jpeg .png .bmp .tif .tiff .webp .heic .heif .hif .avif .pgm or .ppm",
        .found = is_glob ? "" : ExplainNoImages(input),
        .code = ErrorCode::kNotFound});
  }
  std::sort(images.begin(), images.end(), NaturalLess);
  return images;
}

}  // namespace mono3d
