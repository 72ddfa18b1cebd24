// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/undistorter.h"

#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A sampling position may lie this far outside the outermost pixel centres: a fiftieth of a pixel
// is below the 1/32 px to which the maps are rounded.
constexpr double kMaxOutside_px = 0.02;
// Undistorting a point has no closed form. 100 steps are ample for lenses; what has not converged
// by then is found out by the test of the maps.
const cv::TermCriteria kCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-9);

cv::Matx33d MatrixOf(const CameraModel& camera) {
  return {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

// A rectangle of viewing directions, at z = 1.
struct Field {
  double left = -std::numeric_limits<double>::infinity();
  double top = -std::numeric_limits<double>::infinity();
  double right = std::numeric_limits<double>::infinity();
  double bottom = std::numeric_limits<double>::infinity();
};

// The largest rectangle inside the curved border of the undistorted image.
// cv::getOptimalNewCameraMatrix looks at nine points of each side only, and at the outer edges
// of the pixels, so that some of its border pixels have no content.
Field InnerField(const CameraModel& camera) {
  std::vector<cv::Point2d> pixels;
  const double right = camera.width - 1;
  const double bottom = camera.height - 1;
  for (int x = 0; x < camera.width; ++x) {
    pixels.emplace_back(x, 0);
    pixels.emplace_back(x, bottom);
  }
  for (int y = 0; y < camera.height; ++y) {
    pixels.emplace_back(0, y);
    pixels.emplace_back(right, y);
  }
  std::vector<cv::Point2d> directions;
  cv::undistortPoints(pixels, directions, MatrixOf(camera), camera.distortion, cv::noArray(),
                      cv::noArray(), kCriteria);
  Field field;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].x == 0) field.left = std::max(field.left, directions[i].x);
    if (pixels[i].y == 0) field.top = std::max(field.top, directions[i].y);
    if (pixels[i].x == right) field.right = std::min(field.right, directions[i].x);
    if (pixels[i].y == bottom) field.bottom = std::min(field.bottom, directions[i].y);
  }
  return field;
}

CameraModel CameraOf(const Field& field, int width, int height) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = (width - 1) / (field.right - field.left);
  camera.fy = (height - 1) / (field.bottom - field.top);
  camera.cx = -field.left * camera.fx;
  camera.cy = -field.top * camera.fy;
  return camera;
}

bool LiesWithin(const cv::Mat& map, double max) {
  return cv::checkRange(map, true, nullptr, -kMaxOutside_px, max + kMaxOutside_px);
}

// Where the distortion folds back, a line of sight has two pixels.
bool Grows(const cv::Mat& map_x, const cv::Mat& map_y) {
  const cv::Mat step_x = map_x.colRange(1, map_x.cols) - map_x.colRange(0, map_x.cols - 1);
  const cv::Mat step_y = map_y.rowRange(1, map_y.rows) - map_y.rowRange(0, map_y.rows - 1);
  const double smallest = std::numeric_limits<float>::min();
  const double largest = std::numeric_limits<float>::max();
  return cv::checkRange(step_x, true, nullptr, smallest, largest) &&
         cv::checkRange(step_y, true, nullptr, smallest, largest);
}

}  // namespace

Undistorter::Undistorter(const CameraModel& distorted) : camera_(distorted) {
  Validate(distorted, "undistortion");
  camera_.shutter = {};
  if (!distorted.HasDistortion()) return;
  const Error not_a_lens(ErrorParts{.what = "distortion coefficients do not describe a lens",
                                    .where = "undistortion",
                                    .expected = "one viewing direction for each pixel of the image",
                                    .found = {}});
  const Field field = InnerField(distorted);
  if (!(field.right > field.left && field.bottom > field.top)) throw not_a_lens;
  camera_ = CameraOf(field, distorted.width, distorted.height);
  cv::Mat map_x;
  cv::Mat map_y;
  cv::initUndistortRectifyMap(MatrixOf(distorted), distorted.distortion, cv::noArray(),
                              MatrixOf(camera_), cv::Size(camera_.width, camera_.height), CV_32FC1,
                              map_x, map_y);
  const bool is_inside =
      LiesWithin(map_x, camera_.width - 1) && LiesWithin(map_y, camera_.height - 1);
  if (!is_inside || !Grows(map_x, map_y)) throw not_a_lens;
  cv::convertMaps(map_x, map_y, map1_, map2_, CV_16SC2);
}

cv::Mat Undistorter::Undistort(const cv::Mat& image) const {
  if (image.cols != camera_.width || image.rows != camera_.height) {
    throw Error(
        ErrorParts{.what = "image has another size than the camera",
                   .where = "undistortion",
                   .expected = std::to_string(camera_.width) + "x" + std::to_string(camera_.height),
                   .found = std::to_string(image.cols) + "x" + std::to_string(image.rows)});
  }
  if (map1_.empty()) return image;
  cv::Mat undistorted;
  // Replicating the border matters only for the rounding of the outermost positions.
  cv::remap(image, undistorted, map1_, map2_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return undistorted;
}

}  // namespace mono3d
