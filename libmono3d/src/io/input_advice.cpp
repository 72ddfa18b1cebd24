// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/input_advice.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/image_names.h"
#include "mono3d/io/live_input.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

std::string LowerExtension(const fs::path& file) {
  std::string extension = file.extension();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

template <std::size_t kSize>
bool IsOneOf(std::string_view extension, const std::array<std::string_view, kSize>& all) {
  return std::ranges::find(all, extension) != all.end();
}

bool IsTextName(const fs::path& file) {
  constexpr std::array<std::string_view, 6> kAll = {".yaml", ".yml", ".json",
                                                    ".xml",  ".txt", ".csv"};
  return IsOneOf(LowerExtension(file), kAll);
}

// The entries of a folder, sorted; of a huge one a part.
std::vector<fs::path> Entries(const fs::path& folder) {
  constexpr std::size_t kMost = 10'000;
  std::vector<fs::path> entries;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && entries.size() < kMost;
       it.increment(error)) {
    if (!it->path().filename().string().starts_with('.')) entries.push_back(it->path());
  }
  std::ranges::sort(entries, NaturalLess, [](const fs::path& path) { return path.string(); });
  return entries;
}

std::ptrdiff_t CountImages(const fs::path& folder) {
  return std::ranges::count_if(Entries(ImageFolder(folder)),
                               [](const fs::path& path) { return HasImageExtension(path); });
}

// "the folders 100MEDIA (24 images), 101MEDIA: name one of them"
std::string FoldersIn(const std::vector<fs::path>& entries) {
  constexpr std::size_t kMostNamed = 5;
  std::string text;
  std::size_t num_folders = 0;
  std::error_code ignored;
  for (const fs::path& entry : entries) {
    if (!fs::is_directory(entry, ignored) || ++num_folders > kMostNamed) continue;
    const std::ptrdiff_t num_images = CountImages(entry);
    text += (text.empty() ? "" : ", ") + entry.filename().string();
    if (num_images > 0) text += " (" + std::to_string(num_images) + " images)";
  }
  if (num_folders == 0) return {};
  if (num_folders > kMostNamed) {
    text += " and " + std::to_string(num_folders - kMostNamed) + " more";
  }
  return (num_folders == 1 ? "the folder " : "the folders ") + text + ": name " +
         (num_folders == 1 ? "it" : "one of them, or a pattern such as \"*/*.jpg\"");
}

}  // namespace

WhatInsteadOfFile ExplainNoFile(const std::string& input) {
  if (IsLiveInput(input)) {
    const std::string recorder = input.starts_with("/dev/") ? "ffmpeg -f v4l2 -i " : "ffmpeg -i ";
    return {"only mono3d-reconstruct reads a camera that sends now: record it first, as by " +
                recorder + "'" + WithoutPassword(input) + "' -t 60 flight.mp4",
            true};
  }
  if (input.find("://") != std::string::npos) {
    return {
        "of streams, only rtsp://, rtsps://, udp:// and tcp:// are read: record it first, as "
        "by ffmpeg -i '" +
            WithoutPassword(input) + "' -c copy -t 60 flight.mp4",
        true};
  }
  const bool is_number = !input.empty() && input.size() <= 2 &&
                         std::ranges::all_of(input, [](char c) { return c >= '0' && c <= '9'; });
  if (is_number) return {"a camera is named as /dev/video" + input, true};
  return {"there is no such file or folder", false};
}

bool IsVideoName(const fs::path& file) {
  constexpr std::array<std::string_view, 10> kAll = {".mp4",  ".mov", ".mkv", ".avi", ".m4v",
                                                     ".webm", ".mts", ".ts",  ".lrv", ".mpg"};
  return IsOneOf(LowerExtension(file), kAll);
}

bool HasStoredFrameCount(const fs::path& video) {
  constexpr std::array<std::string_view, 4> kAll = {".mp4", ".mov", ".m4v", ".avi"};
  return IsOneOf(LowerExtension(video), kAll);
}

bool IsOtherPhoto(const fs::path& file) {
  constexpr std::array<std::string_view, 9> kAll = {".dng", ".cr2", ".cr3", ".nef", ".arw",
                                                    ".raf", ".orf", ".rw2", ".pef"};
  return IsOneOf(LowerExtension(file), kAll);
}

std::string HowToConvert() { return "develop them to JPEG or TIFF, all in the same way"; }

bool MayBeVideo(const fs::path& file) {
  std::error_code error;
  const bool is_empty = fs::file_size(file, error) == 0 && !error;
  return !is_empty && !IsOtherPhoto(file) && !IsTextName(file);
}

std::string ExplainNoVideo(const fs::path& file) {
  std::error_code ignored;
  if (fs::file_size(file, ignored) == 0) return "the file is empty: copy it again";
  const std::string extension = file.extension().string();
  if (IsOtherPhoto(file)) {
    return extension + " images are not read: " + HowToConvert() + "; and name the folder";
  }
  if (IsTextName(file)) {
    return "neither images nor a video: a calibration is named by --camera, beside an image "
           "folder, a glob or a video";
  }
  if (IsVideoName(file)) {
    return "cannot open the video: where the recording broke off, its index is missing; copy it "
           "again, or repair it";
  }
  return "cannot open the video";
}

std::string ExplainNoImages(const fs::path& folder) {
  const std::vector<fs::path> entries = Entries(ImageFolder(folder));
  if (entries.empty()) return "an empty folder";
  const auto other = std::ranges::find_if(entries, IsOtherPhoto);
  if (other != entries.end()) {
    const std::string extension = LowerExtension(*other);
    const auto num = std::ranges::count(entries, extension, LowerExtension);
    return std::to_string(num) + " " + other->extension().string() +
           " files, which are not read: " + HowToConvert();
  }
  const auto video = std::ranges::find_if(entries, IsVideoName);
  if (video != entries.end()) return "the video " + video->string() + ": name it";
  const std::string folders = FoldersIn(entries);
  return folders.empty() ? std::to_string(entries.size()) + " other files" : folders;
}

}  // namespace mono3d
