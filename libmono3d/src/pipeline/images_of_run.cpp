// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/images_of_run.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <system_error>
#include <vector>

#include "io/heif_file.h"
#include "io/image_file.h"
#include "io/image_list.h"
#include "io/image_source.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

// Lists the files of the folder that are a run's.
constexpr std::string_view kListOfImages = ".images_of_run";

struct PlacedImage {
  std::string name;      // in the folder
  std::string original;  // as the sparse model had it
  fs::path file;         // empty: a frame of a video
  bool is_converted = false;
};
using PlacedImages = std::map<std::int64_t, PlacedImage>;  // by the index of the frame

std::string SixDigits(std::int64_t index) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%06lld", static_cast<long long>(index));
  return text.data();
}

std::string NameOfFrame(std::int64_t index) { return SixDigits(index) + ".jpg"; }

// Few other programs read it.
bool IsHeifFile(const fs::path& file) {
  std::array<char, 12> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return IsHeif({head.data(), head.size()});
}

std::string WithoutBlanks(std::string name) {
  std::ranges::replace_if(
      name,
      [](char c) { return std::string_view(" \t\r\n\v\f").find(c) != std::string_view::npos; },
      '_');
  return name;
}

// Of all keyframes that are images of the input.
PlacedImages ImagesOfKeyframes(const std::string& input, ImagePlacing placing,
                               const Reconstruction& reconstruction) {
  const InputKind kind = KindOfInput(input);
  const bool is_video = kind == InputKind::kVideo;
  std::vector<std::string> files;
  if (kind == InputKind::kImages) files = ListImages(input);
  if (kind == InputKind::kImage) files = {input};
  const std::string video_name = fs::path(input).filename().string();
  PlacedImages images;
  std::map<std::string, int> num_of_name;
  for (const MapReconstruction& map : reconstruction.maps) {
    for (const SparseImage& image : map.sparse.images) {
      PlacedImage placed{.name = NameOfFrame(image.id), .original = image.name, .file = {}};
      if (is_video) {
        if (image.name != video_name + "#" + std::to_string(image.id)) continue;
      } else {
        const auto index = static_cast<std::size_t>(image.id);
        if (index >= files.size() || fs::path(files[index]).filename() != image.name) continue;
        placed.file = files[index];
        placed.name = WithoutBlanks(image.name);
        placed.is_converted = placing != ImagePlacing::kNone && IsHeifFile(placed.file);
        if (placed.is_converted) placed.name += ".jpg";
        ++num_of_name[placed.name];
      }
      images.emplace(image.id, std::move(placed));
    }
  }
  for (auto& [index, placed] : images) {
    const auto found = num_of_name.find(placed.name);
    if (found != num_of_name.end() && found->second > 1) {
      placed.name = SixDigits(index) + "_" + placed.name;
    }
  }
  return images;
}

bool IsInputItself(const PlacedImages& images, const fs::path& folder) {
  std::error_code ignored;
  return std::ranges::any_of(images, [&](const auto& image) {
    const fs::path& file = image.second.file;
    return !file.empty() && fs::equivalent(fs::absolute(file).parent_path(), folder, ignored);
  });
}

void PlaceFile(const fs::path& from, const fs::path& to, ImagePlacing placing) {
  std::error_code failure;
  if (placing == ImagePlacing::kLink) {
    fs::create_symlink(fs::canonical(from), to, failure);
    if (!failure) return;
  }
  fs::copy_file(from, to, failure);
  if (!failure) return;
  throw Error(ErrorParts{.what = "cannot copy the image",
                         .where = to.string(),
                         .expected = {},
                         .found = failure.message(),
                         .code = ErrorCode::kIo});
}

void WriteJpeg(const fs::path& path, const cv::Mat& bgr) {
  // Video has lost more than this before; lossless files would be five times as large.
  constexpr int kQuality = 95;
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void WriteImages(const std::string& input, ImagePlacing placing, const fs::path& folder,
                 const std::set<std::int64_t>& written, PlacedImages& images) {
  CreateOutputFolder(folder);
  std::string list;
  for (const auto& [index, image] : images) list += image.name + "\n";
  WriteFileAtomically(folder / kListOfImages, list);
  std::set<std::int64_t> frames;
  for (const auto& [index, image] : images) {
    if (image.file.empty()) {
      if (!written.contains(index)) frames.insert(index);
    } else if (image.is_converted) {
      WriteJpeg(folder / image.name, ReadImage(image.file));
    } else {
      PlaceFile(image.file, folder / image.name, placing);
    }
  }
  if (frames.empty()) return;
  std::set<std::int64_t> missing = frames;
  ReadVideoFrames(input, frames, [&](std::int64_t index, const cv::Mat& bgr) {
    WriteJpeg(folder / images.at(index).name, bgr);
    missing.erase(index);
  });
  if (!missing.empty()) {
    Log(LogLevel::kWarning, std::to_string(missing.size()) +
                                " frames of the video cannot be read again: images/ and sparse/ "
                                "are without them");
  }
  for (const std::int64_t index : missing) images.erase(index);
}

// But for those named `kept`.
void RemovePlacedImages(const fs::path& images, const std::set<std::string>& kept = {}) {
  std::error_code ignored;
  for (const std::string& name : NamesOfPlacedImages(images)) {
    if (!kept.contains(name)) fs::remove(images / name, ignored);
  }
  fs::remove(images, ignored);  // unless something else is in it
}

}  // namespace

void PlaceImagesOfRun(const std::string& input, ImagePlacing placing, const fs::path& folder,
                      Reconstruction& reconstruction, const std::set<std::int64_t>& written) {
  PlacedImages images = ImagesOfKeyframes(input, placing, reconstruction);
  const fs::path target = folder / kImagesOfRun;
  if (images.empty() || IsInputItself(images, target)) return;
  if (placing != ImagePlacing::kNone) {
    if (!MayPlaceImages(target)) {
      Log(LogLevel::kWarning, target.string() +
                                  " has other files in it: the images of the keyframes are not "
                                  "written");
      return;
    }
    std::set<std::string> kept;
    for (const auto& [index, image] : images) {
      if (image.file.empty() && written.contains(index)) kept.insert(image.name);
    }
    RemovePlacedImages(target, kept);
    WriteImages(input, placing, target, written, images);
  }
  for (MapReconstruction& map : reconstruction.maps) {
    const auto is_here = [&](const SparseImage& image) {
      const auto found = images.find(image.id);
      return found != images.end() && found->second.original == image.name;
    };
    if (placing != ImagePlacing::kNone) {
      std::erase_if(map.sparse.images, [&](const SparseImage& image) { return !is_here(image); });
    }
    for (SparseImage& image : map.sparse.images) {
      if (is_here(image)) image.name = images.at(image.id).name;
    }
  }
}

std::vector<std::string> NamesOfPlacedImages(const fs::path& images) {
  const fs::path list = images / kListOfImages;
  std::error_code ignored;
  std::vector<std::string> names;
  // A link whose image has gone is there, too.
  const auto add = [&](const std::string& name) {
    if (fs::symlink_status(images / name, ignored).type() != fs::file_type::not_found) {
      names.push_back(name);
    }
  };
  // What a run that was killed in the middle of a file has left.
  const auto add_with_partial = [&](const std::string& name) {
    add(name);
    add(name + ".partial");
  };
  if (fs::exists(list, ignored)) {
    for (const std::string& name : ReadLines(list)) {
      if (!name.empty() && name == fs::path(name).filename()) add_with_partial(name);
    }
  }
  add_with_partial(std::string(kListOfImages));
  return names;
}

bool MayPlaceImages(const fs::path& images) {
  const std::vector<std::string> names = NamesOfPlacedImages(images);
  std::error_code error;
  for (fs::directory_iterator it(images, error), end; !error && it != end; it.increment(error)) {
    if (std::ranges::find(names, it->path().filename().string()) == names.end()) return false;
  }
  if (!error || error == std::errc::no_such_file_or_directory) return true;
  Log(LogLevel::kWarning, images.string() + ": cannot read the folder: " + error.message());
  return false;
}

KeyframeImageWriter::KeyframeImageWriter(const fs::path& folder, bool resumes)
    : images_(folder / kImagesOfRun), is_begun_(resumes) {
  if (!resumes) return;
  for (const std::string& name : NamesOfPlacedImages(images_)) {
    const std::optional<std::int64_t> index = ParseInteger(fs::path(name).stem().string());
    if (index && name == NameOfFrame(*index)) written_.insert(*index);
  }
}

void KeyframeImageWriter::Keep(std::int64_t frame_index, const cv::Mat& bgr) {
  // Videos are read a few frames ahead. A run that is resumed reads all those again that it had,
  // and decides on none of them.
  constexpr std::size_t kMaxKept = 16;
  const std::lock_guard lock(mutex_);
  kept_[frame_index] = bgr;
  if (kept_.size() > kMaxKept) kept_.erase(kept_.begin());
}

void KeyframeImageWriter::Decide(std::int64_t frame_index, bool is_keyframe) {
  cv::Mat bgr;
  {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(frame_index);
    if (found != kept_.end()) bgr = found->second;
    kept_.erase(kept_.begin(), kept_.upper_bound(frame_index));
    if (!is_keyframe || bgr.empty() || written_.contains(frame_index)) return;
  }
  if (!is_begun_) {
    if (!MayPlaceImages(images_)) return;  // PlaceImagesOfRun says so
    RemovePlacedImages(images_);
    CreateOutputFolder(images_);
    is_begun_ = true;
  }
  ListUpTo(frame_index);
  WriteJpeg(images_ / NameOfFrame(frame_index), bgr);
  const std::lock_guard lock(mutex_);
  written_.insert(frame_index);
}

// What the list does not name is somebody else's. Of what it names not all need be there, so that
// it is written seldom.
void KeyframeImageWriter::ListUpTo(std::int64_t frame_index) {
  constexpr std::int64_t kAhead = 1000;
  if (frame_index < num_listed_) return;
  num_listed_ = frame_index + kAhead;
  std::string list;
  for (std::int64_t i = 0; i < num_listed_; ++i) list += NameOfFrame(i) + "\n";
  WriteFileAtomically(images_ / kListOfImages, list);
}

std::set<std::int64_t> KeyframeImageWriter::written() const {
  const std::lock_guard lock(mutex_);
  return written_;
}

}  // namespace mono3d
