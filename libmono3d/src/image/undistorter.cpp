// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/undistorter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "core/clamped_int.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

// A sampling position may lie this far outside the outermost pixel centres: a fiftieth of a pixel
// is below the 1/32 px to which the maps are rounded.
constexpr double kMaxOutside_px = 0.02;
// Undistorting a point has no closed form. 100 steps are ample for lenses; what has not converged
// by then is found out by the test of the maps.
const cv::TermCriteria kCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-9);

constexpr double kMaxAngle_rad = Undistorter::kMaxFisheyeAngle_rad;

Error NotALens() {
  return Error(ErrorParts{.what = "distortion coefficients do not describe a lens",
                          .where = "undistortion",
                          .expected = "one viewing direction for each pixel of the image",
                          .found = {}});
}

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

// At z = 1. Those beyond kMaxAngle_rad are drawn onto it: the corners of a rectangle inside then
// lie within it too.
std::vector<cv::Point2d> FisheyeDirections(const CameraModel& camera,
                                           const std::vector<cv::Point2d>& pixels) {
  const FisheyeAngles angles(camera.distortion);
  std::vector<cv::Point2d> directions;
  for (const cv::Point2d& pixel : pixels) {
    const cv::Point2d point((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
    const double radius = std::hypot(point.x, point.y);
    const std::optional<double> angle = angles.At(radius);
    if (!angle && angles.largest() < kMaxAngle_rad) throw NotALens();
    const double reach = std::tan(std::min(angle.value_or(kMaxAngle_rad), kMaxAngle_rad));
    directions.push_back(radius > 0 ? reach / radius * point : point);
  }
  return directions;
}

std::vector<cv::Point2d> Directions(const CameraModel& camera,
                                    const std::vector<cv::Point2d>& pixels) {
  if (camera.lens == LensModel::kFisheye) return FisheyeDirections(camera, pixels);
  std::vector<cv::Point2d> directions;
  cv::undistortPoints(pixels, directions, MatrixOf(camera), camera.distortion, cv::noArray(),
                      cv::noArray(), kCriteria);
  return directions;
}

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
  const std::vector<cv::Point2d> directions = Directions(camera, pixels);
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

// With the larger focal length for both, around the same middle.
CameraModel WithSquarePixels(const CameraModel& camera) {
  CameraModel square = camera;
  square.fx = square.fy = std::max(camera.fx, camera.fy);
  const Eigen::Vector2d middle((camera.width - 1) / 2., (camera.height - 1) / 2.);
  const Eigen::Vector3d ray = camera.Unproject(middle);
  square.cx = middle.x() - square.fx * ray.x();
  square.cy = middle.y() - square.fy * ray.y();
  return square;
}

// Where `distorted` shows each pixel of `straight`.
void MakeMaps(const CameraModel& distorted, const CameraModel& straight, cv::Mat& map_x,
              cv::Mat& map_y) {
  const cv::Size size(straight.width, straight.height);
  if (distorted.lens != LensModel::kFisheye) {
    cv::initUndistortRectifyMap(MatrixOf(distorted), distorted.distortion, cv::noArray(),
                                MatrixOf(straight), size, CV_32FC1, map_x, map_y);
    return;
  }
  map_x.create(size, CV_32FC1);
  map_y.create(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d pixel = ProjectDistorted(distorted, straight.Unproject({x, y}));
      map_x.at<float>(y, x) = static_cast<float>(pixel.x());
      map_y.at<float>(y, x) = static_cast<float>(pixel.y());
    }
  }
}

// The whole pixels of `common` that lie within the outermost pixel centres of `field`, both without
// distortion and of the same axes.
cv::Rect ContentIn(const CameraModel& common, const CameraModel& field) {
  // A pixel centre that lies on the border but for rounding.
  constexpr double kRounding_px = 1e-6;
  const Eigen::Vector2d first =
      common.Project(field.Unproject({0, 0})) - Eigen::Vector2d::Constant(kRounding_px);
  const Eigen::Vector2d last =
      common.Project(field.Unproject({field.width - 1, field.height - 1})) +
      Eigen::Vector2d::Constant(kRounding_px);
  const cv::Point from(ClampedInt(std::ceil(first.x()), 0, common.width),
                       ClampedInt(std::ceil(first.y()), 0, common.height));
  const cv::Point to(ClampedInt(std::floor(last.x()), -1, common.width),
                     ClampedInt(std::floor(last.y()), -1, common.height));
  if (to.x < from.x || to.y < from.y) return {};
  return cv::Rect(from, to + cv::Point(1, 1)) & cv::Rect(0, 0, common.width, common.height);
}

bool LiesWithin(const cv::Mat& map, double max) {
  return cv::checkRange(map, true, nullptr, -kMaxOutside_px, max + kMaxOutside_px);
}

bool AreAllAbove0(const cv::Mat& steps) {
  return cv::checkRange(steps, true, nullptr, std::numeric_limits<float>::min(),
                        std::numeric_limits<float>::max());
}

// Where the distortion folds back, a line of sight has two pixels. A single column or row does not.
bool Grows(const cv::Mat& map_x, const cv::Mat& map_y) {
  if (map_x.cols > 1 &&
      !AreAllAbove0(map_x.colRange(1, map_x.cols) - map_x.colRange(0, map_x.cols - 1))) {
    return false;
  }
  return map_y.rows == 1 ||
         AreAllAbove0(map_y.rowRange(1, map_y.rows) - map_y.rowRange(0, map_y.rows - 1));
}

}  // namespace

Undistorter::Undistorter(const CameraModel& distorted)
    : camera_(distorted),
      taken_size_(distorted.width, distorted.height),
      content_(0, 0, distorted.width, distorted.height) {
  Validate(distorted, "undistortion");
  camera_.shutter = {};
  if (!distorted.HasDistortion()) return;
  const Field field = InnerField(distorted);
  if (!(field.right > field.left && field.bottom > field.top)) throw NotALens();
  camera_ = CameraOf(field, distorted.width, distorted.height);
  if (distorted.lens == LensModel::kFisheye) camera_ = WithSquarePixels(camera_);
  TakeMaps(distorted);
}

Undistorter::Undistorter(const CameraModel& distorted, const CameraModel& common)
    : Undistorter(distorted) {
  Validate(common, "undistortion");
  if (common.HasDistortion()) throw Error("undistortion: the common camera has distortion");
  const cv::Rect shown = ContentIn(common, camera_);
  if (shown.empty()) throw Error("undistortion: the common camera shows nothing of the image");
  camera_ = common;
  content_ = shown;
  TakeMaps(distorted);
}

void Undistorter::TakeMaps(const CameraModel& distorted) {
  CameraModel straight = camera_;
  straight.width = content_.width;
  straight.height = content_.height;
  straight.cx -= content_.x;
  straight.cy -= content_.y;
  cv::Mat map_x;
  cv::Mat map_y;
  MakeMaps(distorted, straight, map_x, map_y);
  const bool is_inside =
      LiesWithin(map_x, distorted.width - 1) && LiesWithin(map_y, distorted.height - 1);
  if (!is_inside || !Grows(map_x, map_y)) throw NotALens();
  cv::convertMaps(map_x, map_y, map1_, map2_, CV_16SC2);
}

cv::Mat Undistorter::Undistort(const cv::Mat& image) const {
  if (image.size() != taken_size_) {
    throw Error(ErrorParts{
        .what = "image has another size than the camera",
        .where = "undistortion",
        .expected = std::to_string(taken_size_.width) + "x" + std::to_string(taken_size_.height),
        .found = std::to_string(image.cols) + "x" + std::to_string(image.rows)});
  }
  if (map1_.empty()) return image;
  cv::Mat content;
  // Replicating the border matters only for the rounding of the outermost positions.
  cv::remap(image, content, map1_, map2_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  const int right = camera_.width - content_.br().x;
  const int bottom = camera_.height - content_.br().y;
  if (content.cols == camera_.width && content.rows == camera_.height) return content;
  cv::Mat undistorted;
  cv::copyMakeBorder(content, undistorted, content_.y, bottom, content_.x, right,
                     cv::BORDER_REPLICATE);
  return undistorted;
}

}  // namespace mono3d
