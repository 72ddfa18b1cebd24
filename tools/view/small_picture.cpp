// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/small_picture.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace mono3d::tools {

cv::Mat SmallPicture(const cv::Mat& image, int width_px, int interpolation) {
  if (image.cols <= width_px) return image.clone();
  const int height_px = std::max(1, image.rows * width_px / image.cols);
  cv::Mat small;
  cv::resize(image, small, {width_px, height_px}, 0, 0, interpolation);
  return small;
}

SharedBytes ToJpeg(const cv::Mat& image) {
  if (image.empty()) return nullptr;
  std::vector<uchar> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 80});
  return std::make_shared<const std::string>(bytes.begin(), bytes.end());
}

}  // namespace mono3d::tools
