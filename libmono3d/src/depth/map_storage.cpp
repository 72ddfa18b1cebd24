// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/map_storage.h"

namespace mono3d {
namespace {

// Depth, normals, confidence and the mask of two maps: while one is made, another may be in use.
constexpr std::size_t kMaxImages = 8;

bool IsFree(const cv::Mat& image) {
  return image.u != nullptr && CV_XADD(&image.u->refcount, 0) == 1;
}

}  // namespace

cv::Mat MapStorage::Take(cv::Size size, int type) {
  for (const cv::Mat& image : handed_out_) {
    if (image.size() == size && image.type() == type && IsFree(image)) return image;
  }
  cv::Mat image(size, type);
  if (handed_out_.size() < kMaxImages) {
    handed_out_.push_back(image);
  } else {
    handed_out_[next_] = image;
    next_ = (next_ + 1) % kMaxImages;
  }
  return image;
}

}  // namespace mono3d
