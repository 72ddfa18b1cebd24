// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/input_check.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <system_error>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/io/image_file.h"

namespace mono3d::tools {
namespace {

constexpr std::int64_t kFewestImages = 3;

std::string FileBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// An eighth of the size: enough to tell images apart. Empty where it cannot be read.
cv::Mat SmallImage(const std::string& path) {
  try {
    return ReadSmallImage(path);
  } catch (const Error&) {
    return {};
  }
}

// The bytes of an image, and where they differ its pixels; each read once.
class OneImage {
 public:
  explicit OneImage(const std::string& path) : path_(path) {}

  bool IsSameAs(const std::string& other) {
    std::error_code ignored;
    if (std::filesystem::file_size(path_, ignored) == std::filesystem::file_size(other, ignored)) {
      if (bytes_.empty()) bytes_ = FileBytes(path_);
      if (FileBytes(other) == bytes_) return true;
    }
    if (!small_) small_ = SmallImage(path_);
    const cv::Mat small = SmallImage(other);
    return !small.empty() && small.size() == small_->size() &&
           cv::norm(small, *small_, cv::NORM_INF) == 0;
  }

 private:
  std::string path_;
  std::string bytes_;
  std::optional<cv::Mat> small_;
};

// Two that differ end it.
bool AreAllSame(const std::vector<std::string>& images) {
  if (SmallImage(images.front()).empty()) return false;  // unreadable: that is told elsewhere
  OneImage first(images.front());
  for (std::size_t i = 1; i < images.size(); ++i) {
    if (!first.IsSameAs(images[i])) return false;
  }
  return true;
}

}  // namespace

void RequireOtherFolder(const std::string& input, const std::filesystem::path& output) {
  std::error_code ignored;
  if (!std::filesystem::exists(output, ignored)) return;
  if (std::filesystem::is_regular_file(input, ignored)) return;  // a video
  const std::filesystem::path image = ListImages(input).front();
  const std::filesystem::path images = image.has_parent_path() ? image.parent_path() : ".";
  if (!std::filesystem::equivalent(images, output, ignored)) return;
  throw UsageError(ErrorParts{.what = "the images lie there, and pictures of the run would be "
                                      "taken for images of the next one: name another folder",
                              .where = "--output",
                              .expected = "a folder of the run's own",
                              .found = output.string()});
}

void RequireImagesOfPlaces(const std::string& input, const CameraModel& camera,
                           const FrameSourceOptions& source) {
  const std::unique_ptr<FrameSource> frames = OpenFrameSource(input, camera, source);
  const std::optional<std::int64_t> num_images = frames->num_frames();
  if (num_images && *num_images < kFewestImages) {
    throw Error(ErrorParts{
        .what = "too few images: depth needs three and more, from places apart; name a folder, a "
                "quoted glob or a video, and see --start, --stride and --max-frames",
        .where = input,
        .expected = std::to_string(kFewestImages) + " or more",
        .found = std::to_string(*num_images)});
  }
  std::error_code ignored;
  if (std::filesystem::is_regular_file(input, ignored)) {  // a video
    (void)frames->Next();  // throws where it does not fit the calibration
    return;
  }
  const std::vector<std::string> images = ListImages(input);
  if (!AreAllSame(images)) return;
  throw Error(ErrorParts{
      .what = "all images show the same: depth needs images from places apart; take them from the "
              "video again, or see that they are not copies of one",
      .where = input,
      .expected = "images of a moving camera",
      .found = std::to_string(images.size()) + " times the same image"});
}

}  // namespace mono3d::tools
