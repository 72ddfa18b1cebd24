// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/jpeg.h"

#include <opencv2/imgcodecs.hpp>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {

std::vector<unsigned char> JpegOf(const cv::Mat& bgr, int quality) {
  std::vector<unsigned char> bytes;
  const bool is_written = !bgr.empty() && cv::imencode(".jpg", bgr, bytes,
                                                       {cv::IMWRITE_JPEG_QUALITY, quality,
                                                        cv::IMWRITE_JPEG_OPTIMIZE, 1});
  if (!is_written) {
    throw Error(ErrorParts{"cannot write an image as JPEG",
                           {},
                           "1 to 65535 px",
                           std::to_string(bgr.cols) + "x" + std::to_string(bgr.rows)});
  }
  return bytes;
}

}  // namespace mono3d
