// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "io/image_file.h"
#include "io/image_list.h"
#include "io/image_source.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d {
namespace {

// Beside the images, or beside the folder images/ that they are in.
std::filesystem::path TimestampsFile(const std::filesystem::path& image_folder) {
  const std::filesystem::path beside = image_folder / "timestamps.txt";
  const bool is_inner =
      std::filesystem::absolute(image_folder / ".").parent_path().filename() == "images";
  std::error_code ignored;
  if (!is_inner || std::filesystem::exists(beside, ignored)) return beside;
  return image_folder / ".." / "timestamps.txt";
}

class ImageListSource : public ImageSource {
 public:
  ImageListSource(ImageList list, const FrameSourceOptions& options)
      : list_(std::move(list)),
        stride_(static_cast<std::size_t>(std::max(1, options.stride))),
        fps_(options.fps > 0 ? options.fps : kDefaultFps),
        next_(static_cast<std::size_t>(options.start)) {
    if (options.fps > 0) list_.timestamps_s.clear();
    const std::size_t size = list_.images.size();
    num_frames_ = next_ < size ? (size - next_ + stride_ - 1) / stride_ : 0;
    if (options.max_frames > 0) {
      num_frames_ = std::min(num_frames_, static_cast<std::size_t>(options.max_frames));
    }
    if (num_frames_ == 0) {
      throw Error(ErrorParts{.what = "no image is left to read",
                             .where = list_.name,
                             .expected = "a start below " + std::to_string(size),
                             .found = "start " + std::to_string(options.start)});
    }
  }

  std::optional<SourceImage> Next() override {
    while (num_tried_ < num_frames_) {
      const std::size_t index = next_;
      next_ += stride_;
      ++num_tried_;
      try {
        return SourceImage{static_cast<std::int64_t>(index), Timestamp(index),
                           std::filesystem::path(list_.images[index]).filename(),
                           ReadImage(list_.images[index], ValueBits())};
      } catch (const Error& error) {
        if (!list_.skip_unreadable) throw;
        ++num_skipped_;
        Log(LogLevel::kWarning, std::string("skipped: ") + error.what());
      }
    }
    if (num_skipped_ == num_frames_) {
      throw Error(ErrorParts{.what = "not one image can be read",
                             .where = list_.name,
                             .expected = {},
                             .found = std::to_string(num_skipped_) + " unreadable"});
    }
    return std::nullopt;
  }

  std::optional<std::int64_t> num_frames() const override {
    return static_cast<std::int64_t>(num_frames_);
  }
  std::int64_t num_skipped() const override { return static_cast<std::int64_t>(num_skipped_); }

 private:
  // Of all images of the list, so that they stay alike.
  int ValueBits() {
    if (value_bits_) return *value_bits_;
    value_bits_ = FindValueBits(list_.images);
    if (*value_bits_ < 16) {
      Log(LogLevel::kWarning, list_.name +
                                  ": the values of the 16-bit images are small: taken as " +
                                  std::to_string(*value_bits_) + "-bit ones (times " +
                                  std::to_string(1 << (16 - *value_bits_)) + ")");
    }
    return *value_bits_;
  }

  double Timestamp(std::size_t index) const {
    return list_.timestamps_s.empty() ? static_cast<double>(index) / fps_
                                      : list_.timestamps_s[index];
  }

  ImageList list_;
  std::size_t stride_;
  double fps_;
  std::optional<int> value_bits_;
  std::size_t next_;
  std::size_t num_frames_ = 0;
  std::size_t num_tried_ = 0;
  std::size_t num_skipped_ = 0;
};

}  // namespace

ImageList FindImages(const std::string& input) {
  ImageList list{input, ListImages(input), {}, true};
  if (IsGlob(input)) return list;
  const std::filesystem::path file = TimestampsFile(ImageFolder(input));
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return list;
  list.timestamps_s = ReadTimestamps(file);
  if (list.timestamps_s.size() != list.images.size()) {
    throw Error(ErrorParts{.what = "wrong number of timestamps",
                           .where = file,
                           .expected = std::to_string(list.images.size()) + ", one for each image",
                           .found = std::to_string(list.timestamps_s.size())});
  }
  return list;
}

std::unique_ptr<ImageSource> OpenImageList(ImageList list, const FrameSourceOptions& options) {
  return std::make_unique<ImageListSource>(std::move(list), options);
}

}  // namespace mono3d
