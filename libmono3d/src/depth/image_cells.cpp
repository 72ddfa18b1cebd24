// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/image_cells.h"

#include <opencv2/imgproc.hpp>

namespace mono3d {

cv::Mat MeansOfCells(const cv::Mat& image) {
  const auto missing = [](int length) {
    return (kImageCell_px - length % kImageCell_px) % kImageCell_px;
  };
  cv::Mat whole = image;
  if (missing(image.rows) != 0 || missing(image.cols) != 0) {
    cv::copyMakeBorder(image, whole, 0, missing(image.rows), 0, missing(image.cols),
                       cv::BORDER_REPLICATE);
  }
  cv::Mat means;
  cv::resize(whole, means, cv::Size(whole.cols / kImageCell_px, whole.rows / kImageCell_px), 0, 0,
             cv::INTER_AREA);
  return means;
}

}  // namespace mono3d
