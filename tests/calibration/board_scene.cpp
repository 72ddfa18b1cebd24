// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "mono3d/geometry/distortion.h"
#include "reference/random.h"

namespace mono3d {
namespace {

constexpr int kSquare_px = 60;    // of the picture of the board
constexpr int kPartsOfPixel = 3;  // in each direction
constexpr int kDark = 30;
constexpr int kBright = 215;
constexpr int kBackground = 120;

cv::Mat DrawChessboard(int columns, int rows) {
  cv::Mat picture(rows * kSquare_px, columns * kSquare_px, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const bool is_dark = (x / kSquare_px + y / kSquare_px) % 2 == 0;
      picture.at<std::uint8_t>(y, x) = is_dark ? 0 : 255;
    }
  }
  return picture;
}

// Only dictionaries of 5x5 bits.
cv::Mat DrawCharuco(const CalibrationBoard& board) {
  const auto drawn = cv::aruco::CharucoBoard::create(
      board.columns, board.rows, 1.F, static_cast<float>(board.marker_share),
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
  cv::Mat picture;
  drawn->draw({board.columns * kSquare_px, board.rows * kSquare_px}, picture);
  // Its plane has y upwards, as drawn by OpenCV; corners are numbered from below.
  return picture;
}

Eigen::Vector3d FisheyeRay(const CameraModel& camera, const FisheyeAngles& angles,
                           const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d point = camera.Unproject(pixel).head<2>();
  const double angle = angles.At(point.norm()).value();
  Eigen::Vector3d ray;
  ray << std::sin(angle) * point.normalized(), std::cos(angle);
  return ray;
}

cv::Mat PixelParts(const CameraModel& camera) {
  cv::Mat pixels(camera.height * kPartsOfPixel, camera.width * kPartsOfPixel, CV_32FC2);
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) {
      pixels.at<cv::Vec2f>(y, x) = {(static_cast<float>(x) + 0.5F) / kPartsOfPixel - 0.5F,
                                    (static_cast<float>(y) + 0.5F) / kPartsOfPixel - 0.5F};
    }
  }
  return pixels;
}

cv::Mat FisheyeRays(const CameraModel& camera) {
  const FisheyeAngles angles(camera.distortion);
  const cv::Mat pixels = PixelParts(camera);
  cv::Mat rays(pixels.size(), CV_32FC3);
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) {
      const auto pixel = pixels.at<cv::Vec2f>(y, x);
      const Eigen::Vector3f ray = FisheyeRay(camera, angles, {pixel[0], pixel[1]}).cast<float>();
      rays.at<cv::Vec3f>(y, x) = {ray.x(), ray.y(), ray.z()};
    }
  }
  return rays;
}

cv::Mat Rays(const CameraModel& camera) {
  if (camera.lens == LensModel::kFisheye) return FisheyeRays(camera);
  const cv::Mat pixels = PixelParts(camera);
  cv::Mat K;
  cv::eigen2cv(camera.Matrix(), K);
  const cv::Mat coefficients(
      std::vector<double>(camera.distortion.begin(), camera.distortion.end()), true);
  cv::Mat points;
  cv::undistortPoints(pixels.reshape(2, pixels.rows * pixels.cols), points, K, coefficients,
                      cv::noArray(), cv::noArray(),
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-6});
  cv::Mat rays;
  cv::convertPointsToHomogeneous(points, rays);
  return rays.reshape(3, pixels.rows);
}

}  // namespace

CameraModel BoardCamera() {
  return {640, 480, 520, 520, 326, 235, {-0.15, 0.05, 0.001, -0.0008, 0}};
}

CameraModel FisheyeBoardCamera() {
  CameraModel camera = {640, 480, 275, 275, 326, 235, {0.03, -0.01, 0.003, -0.0005, 0}};
  camera.lens = LensModel::kFisheye;
  return camera;
}

BoardScene::BoardScene(const CalibrationBoard& board, const CameraModel& camera)
    : camera_(camera), columns_(board.columns), rows_(board.rows), rays_(Rays(camera)) {
  if (board.kind == BoardKind::kChessboard) {
    ++columns_;
    ++rows_;
    picture_ = DrawChessboard(columns_, rows_);
  } else {
    picture_ = DrawCharuco(board);
  }
  cv::copyMakeBorder(picture_, picture_, kSquare_px, kSquare_px, kSquare_px, kSquare_px,
                     cv::BORDER_CONSTANT, cv::Scalar(255));
  picture_.convertTo(picture_, CV_8U, (kBright - kDark) / 255., kDark);
}

cv::Mat BoardScene::Render(const Pose& T_cam_board, std::mt19937& random) const {
  // A ray times this is a point of the board up to its scale.
  Eigen::Matrix3d H;
  H << T_cam_board.rotation().toRotationMatrix().leftCols<2>(), T_cam_board.translation();
  const Eigen::Matrix3d to_board = H.inverse();
  cv::Mat parts(rays_.size(), CV_8UC1);
  for (int y = 0; y < parts.rows; ++y) {
    for (int x = 0; x < parts.cols; ++x) {
      const auto ray = rays_.at<cv::Vec3f>(y, x);
      const Eigen::Vector3d p = to_board * Eigen::Vector3d(ray[0], ray[1], ray[2]);
      const cv::Point at(static_cast<int>(std::floor((p.x() / p.z() + 1) * kSquare_px)),
                         static_cast<int>(std::floor((p.y() / p.z() + 1) * kSquare_px)));
      const bool is_on_board = p.z() > 0 && at.inside({0, 0, picture_.cols, picture_.rows});
      parts.at<std::uint8_t>(y, x) =
          is_on_board ? picture_.at<std::uint8_t>(at) : static_cast<std::uint8_t>(kBackground);
    }
  }
  cv::Mat image;
  cv::resize(parts, image, {camera_.width, camera_.height}, 0, 0, cv::INTER_AREA);
  constexpr double kBlur_px = 0.6;
  cv::GaussianBlur(image, image, {}, kBlur_px);
  constexpr double kNoise = 2;
  cv::Mat noise(image.size(), CV_16SC1);
  cv::RNG generator(random());
  generator.fill(noise, cv::RNG::NORMAL, 0, kNoise);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
  cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  return image;
}

Pose BoardScene::RandomPose(std::mt19937& random, double tilt_deg) const {
  const double tilt = tilt_deg * std::numbers::pi / 180;
  while (true) {
    const double direction = Uniform(random, 0, 2 * std::numbers::pi);
    const Eigen::Quaterniond rotation(
        Eigen::AngleAxisd(Uniform(random, 0.3, 1) * tilt,
                          Eigen::Vector3d(std::cos(direction), std::sin(direction), 0)) *
        Eigen::AngleAxisd(Uniform(random, -0.4, 0.4), Eigen::Vector3d::UnitZ()));
    // The board takes 0.45 to 0.95 of the width, and lies where it is seen whole.
    const double share = Uniform(random, 0.45, 0.95);
    const double distance = camera_.fx / camera_.width * columns_ / share;
    const Eigen::Vector2d pixel(camera_.width * Uniform(random, 0.2, 0.8),
                                camera_.height * Uniform(random, 0.2, 0.8));
    const Eigen::Vector3d middle = distance * camera_.Unproject(pixel);
    const Pose T_cam_board(rotation,
                           middle - rotation * Eigen::Vector3d(0.5 * columns_, 0.5 * rows_, 0));
    bool is_visible = true;
    for (const double x : {-0.3, columns_ + 0.3}) {
      for (const double y : {-0.3, rows_ + 0.3}) {
        is_visible = is_visible && camera_.Contains(ProjectDistorted(
                                       camera_, T_cam_board * Eigen::Vector3d(x, y, 0)));
      }
    }
    if (is_visible) return T_cam_board;
  }
}

std::vector<cv::Mat> BoardScene::RenderMany(int num_images, double tilt_deg, unsigned seed) const {
  std::mt19937 random(seed);
  std::vector<cv::Mat> images;
  for (int i = 0; i < num_images; ++i) {
    images.push_back(Render(RandomPose(random, tilt_deg), random));
  }
  return images;
}

}  // namespace mono3d
