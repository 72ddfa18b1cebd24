// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// The folder beside sparse/ in which programs look for the images that it names.
inline constexpr std::string_view kImagesOfRun = "images";

enum class ImagePlacing {
  // Images that are files are linked; copied where the file system has no links, and HEIC, which
  // few other programs read, is written as JPEG.
  kLink,
  kCopy,  // HEIC as JPEG
  kNone,  // nothing is written
};

// Makes `folder` (in which sparse/ is) a workspace that COLMAP and what reads its files can go on
// in: folder/images holds the images of the keyframes of all maps as they were taken, the sparse
// models name them, and have no image that is not there, as those of a map that was loaded. Frames
// of a video become NNNNNN.jpg, NNNNNN being the number of the frame as in depth/; images of a
// folder or glob, `input`, keep their names, with "_" for blanks, which COLMAP's text form does not
// take, and "NNNNNN_" before the name where there are several of it. With kNone only the names are
// given.
// Where folder/images is the input itself, or holds something that is not an earlier run's, nothing
// is written, with a warning in the log in the second case. Frames that are `written` there already
// (KeyframeImageWriter) are not read again. Throws Error when an image cannot be written.
void PlaceImagesOfRun(const std::string& input, ImagePlacing placing,
                      const std::filesystem::path& folder, Reconstruction& reconstruction,
                      const std::set<std::int64_t>& written = {});

// The files that PlaceImagesOfRun wrote into `images`, by their names.
std::vector<std::string> NamesOfPlacedImages(const std::filesystem::path& images);

// Is there nothing in `images` but these, so that other images may take their place?
bool MayPlaceImages(const std::filesystem::path& images);

// Writes the frames of a video that become keyframes into folder/images while the video is read, as
// PlaceImagesOfRun would, which then has no need to read all of it once more. Keep may be called
// by another thread than Decide.
class KeyframeImageWriter {
 public:
  // `resumes`: goes on beside the images that an earlier writer has left there. Else these make
  // room for the first one.
  KeyframeImageWriter(const std::filesystem::path& folder, bool resumes);

  // The frame as it was taken; not copied. Of those that are not decided on the latest 16 are kept:
  // a keyframe among the others is left to PlaceImagesOfRun.
  void Keep(std::int64_t frame_index, const cv::Mat& bgr);
  // Writes it, or lets it go, and those before it. Throws Error when it cannot be written.
  void Decide(std::int64_t frame_index, bool is_keyframe);

  std::set<std::int64_t> written() const;  // all that are there

 private:
  void ListUpTo(std::int64_t frame_index);

  std::filesystem::path images_;
  bool is_begun_;
  std::int64_t num_listed_ = 0;
  mutable std::mutex mutex_;
  std::map<std::int64_t, cv::Mat> kept_;
  std::set<std::int64_t> written_;
};

}  // namespace mono3d
