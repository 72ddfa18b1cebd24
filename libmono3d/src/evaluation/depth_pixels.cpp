// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/depth_pixels.h"

#include <opencv2/core.hpp>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string SizeAndType(int type, const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height) + " " +
         cv::typeToString(type);
}

}  // namespace

void RequireImage(const cv::Mat& image, const char* what, int type, const cv::Size& size) {
  if (image.type() == type && image.size() == size && !image.empty()) return;
  throw Error(ErrorParts{
      .what = std::string(what) + " has another size or type",
      .where = {},
      .expected = SizeAndType(type, size),
      .found = image.empty() ? "an empty image" : SizeAndType(image.type(), image.size())});
}

void RequireDepthPair(const cv::Mat& estimate, const cv::Mat& truth) {
  RequireImage(truth, "the true depth", CV_32FC1, truth.size());
  RequireImage(estimate, "the estimated depth", CV_32FC1, truth.size());
}

}  // namespace mono3d
