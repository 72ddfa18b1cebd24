// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/products/finished_run.h"

namespace mono3d {

// Each level half the size of the one before; CV_8UC3, as OpenCV orders the colours.
using ImagePyramid = std::vector<cv::Mat>;

// Is the image there, of the size of its camera? By its header, where OpenCV reads that alone.
bool HasPixels(const RunImage& image);

// Images of a run, read when they are needed and kept while there is room. For one thread at a
// time.
class ImageCache {
 public:
  // `images` must outlive it.
  explicit ImageCache(const std::vector<RunImage>& images);

  // Empty where the image cannot be read or has another size than its camera. Stays valid until the
  // next call.
  const ImagePyramid& Get(std::size_t image);

 private:
  struct Entry {
    ImagePyramid levels;
    std::size_t num_bytes = 0;
    std::uint64_t last_use = 0;
  };

  void MakeRoom();

  const std::vector<RunImage>& images_;
  std::vector<Entry> entries_;
  std::size_t num_bytes_ = 0;
  std::uint64_t num_uses_ = 0;
};

// The colour at a pixel of the image, of a patch of 2^level pixels a side; blue, green, red.
// Cubic between the pixels.
cv::Vec3f ColourAt(const ImagePyramid& levels, int level, float x, float y);

}  // namespace mono3d
