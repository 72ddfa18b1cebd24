// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/frame.h"

#include <opencv2/imgproc.hpp>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string SizeText(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

cv::Rect Frame::ContentOrAll() const {
  return content.empty() ? cv::Rect(0, 0, camera.width, camera.height) : content;
}

bool Frame::Shows(const Eigen::Vector2d& pixel) const {
  const cv::Rect shown = ContentOrAll();
  return pixel.x() >= shown.x && pixel.y() >= shown.y && pixel.x() <= shown.x + shown.width - 1 &&
         pixel.y() <= shown.y + shown.height - 1;
}

cv::Mat ToGrey(const cv::Mat& bgr) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

void Validate(const Frame& frame) {
  Validate(frame.camera, frame.name);
  if (frame.bgr.type() != CV_8UC3) {
    throw Error(ErrorParts{.what = "wrong image type",
                           .where = frame.name,
                           .expected = "8-bit colour (CV_8UC3)",
                           .found = cv::typeToString(frame.bgr.type())});
  }
  if (frame.bgr.cols != frame.camera.width || frame.bgr.rows != frame.camera.height) {
    throw Error(ErrorParts{.what = "image has another size than the calibration",
                           .where = frame.name,
                           .expected = SizeText(frame.camera.width, frame.camera.height),
                           .found = SizeText(frame.bgr.cols, frame.bgr.rows)});
  }
  const cv::Rect image(0, 0, frame.camera.width, frame.camera.height);
  if (!frame.content.empty() && (frame.content & image) != frame.content) {
    throw Error(ErrorParts{.what = "content is not within the image",
                           .where = frame.name,
                           .expected = SizeText(image.width, image.height),
                           .found = SizeText(frame.content.br().x, frame.content.br().y)});
  }
  if (frame.camera.HasDistortion()) {
    throw Error(ErrorParts{.what = "image is distorted",
                           .where = frame.name,
                           .expected = "an undistorted image and a camera without distortion",
                           .found = {}});
  }
}

}  // namespace mono3d
