// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/image_cache.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "mono3d/core/error.h"
#include "mono3d/io/image_file.h"

namespace mono3d {
namespace {

constexpr std::size_t kMaxCacheBytes = std::size_t{1} << 30;
constexpr int kNumLevels = 5;

ImagePyramid LoadPyramid(const RunImage& image) {
  ImagePyramid levels;
  if (image.file.empty()) return levels;
  cv::Mat pixels;
  try {
    pixels = ReadImage(image.file);
  } catch (const Error&) {  // damaged
  }
  if (pixels.cols != image.camera.width || pixels.rows != image.camera.height) return levels;
  levels.push_back(pixels);
  while (levels.size() < kNumLevels && std::min(levels.back().cols, levels.back().rows) > 32) {
    cv::Mat half;
    cv::pyrDown(levels.back(), half);
    levels.push_back(half);
  }
  return levels;
}

// Catmull and Rom's: through the pixels, with the slopes of their neighbours.
std::array<float, 4> CubicWeights(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {0.5F * (-t3 + 2 * t2 - t), 0.5F * (3 * t3 - 5 * t2 + 2), 0.5F * (-3 * t3 + 4 * t2 + t),
          0.5F * (t3 - t2)};
}

}  // namespace

bool HasPixels(const RunImage& image) {
  if (image.file.empty()) return false;
  try {
    constexpr int kPart = 8;
    const cv::Mat small = ReadSmallImage(image.file);
    return std::abs(small.cols * kPart - image.camera.width) < kPart &&
           std::abs(small.rows * kPart - image.camera.height) < kPart;
  } catch (const Error&) {  // it is not there, or damaged
    return false;
  }
}

ImageCache::ImageCache(const std::vector<RunImage>& images)
    : images_(images), entries_(images.size()) {}

const ImagePyramid& ImageCache::Get(std::size_t image) {
  Entry& entry = entries_[image];
  entry.last_use = ++num_uses_;
  if (!entry.levels.empty()) return entry.levels;
  MakeRoom();
  entry.levels = LoadPyramid(images_[image]);
  entry.num_bytes = 0;
  for (const cv::Mat& level : entry.levels) entry.num_bytes += level.total() * level.elemSize();
  num_bytes_ += entry.num_bytes;
  return entry.levels;
}

void ImageCache::MakeRoom() {
  while (num_bytes_ > kMaxCacheBytes) {
    Entry* oldest = nullptr;
    for (Entry& entry : entries_) {
      if (entry.levels.empty()) continue;
      if (oldest == nullptr || entry.last_use < oldest->last_use) oldest = &entry;
    }
    if (oldest == nullptr) return;
    num_bytes_ -= oldest->num_bytes;
    oldest->levels.clear();
  }
}

cv::Vec3f ColourAt(const ImagePyramid& levels, int level, float x, float y) {
  const int used = std::clamp(level, 0, static_cast<int>(levels.size()) - 1);
  const cv::Mat& image = levels[static_cast<std::size_t>(used)];
  // Pixel (0, 0) of every level has the same centre.
  const float scale = 1.F / static_cast<float>(1 << used);
  x *= scale;
  y *= scale;
  const float left = std::floor(x), top = std::floor(y);
  const std::array<float, 4> across = CubicWeights(x - left), down = CubicWeights(y - top);
  cv::Vec3f sum(0, 0, 0);
  for (int j = 0; j < 4; ++j) {
    const int row = std::clamp(static_cast<int>(top) + j - 1, 0, image.rows - 1);
    const auto* pixels = image.ptr<cv::Vec3b>(row);
    cv::Vec3f of_row(0, 0, 0);
    for (int i = 0; i < 4; ++i) {
      const int column = std::clamp(static_cast<int>(left) + i - 1, 0, image.cols - 1);
      of_row += across[static_cast<std::size_t>(i)] * cv::Vec3f(pixels[column]);
    }
    sum += down[static_cast<std::size_t>(j)] * of_row;
  }
  return sum;
}

}  // namespace mono3d
