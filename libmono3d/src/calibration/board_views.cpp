// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_views.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace mono3d::calibration {
namespace {

// How the board lies in the image: its middle and size in shares of the image; the direction and
// logarithm of its foreshortening; how much larger its near side is.
using ViewSignature = Eigen::Matrix<double, 7, 1>;
// A step of the board by 2 % of the image, or a turn from 0 to 11 degrees.
constexpr double kSameView = 0.02;

ViewSignature SignatureOf(const BoardView& view, cv::Size image_size) {
  cv::Point2f middle(0, 0);
  for (const cv::Point3f& corner : view.corners) middle += cv::Point2f(corner.x, corner.y);
  middle *= 1.F / static_cast<float>(view.corners.size());
  std::vector<cv::Point2f> corners;
  for (const cv::Point3f& corner : view.corners) {
    corners.push_back(cv::Point2f(corner.x, corner.y) - middle);
  }
  const cv::Mat found = cv::findHomography(corners, view.pixels);
  if (found.empty()) return ViewSignature::Zero();
  Eigen::Matrix3d H;
  for (int i = 0; i < 9; ++i) H(i / 3, i % 3) = found.at<double>(i / 3, i % 3);
  H /= H(2, 2);
  const Eigen::Vector2d pixel = H.topRightCorner<2, 1>();
  const Eigen::RowVector2d perspective = H.bottomLeftCorner<1, 2>();
  // The derivative of the pixel by the place on the board, at its middle.
  const Eigen::Matrix2d J = H.topLeftCorner<2, 2>() - pixel * perspective;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(J * J.transpose());  // rising
  const Eigen::Vector2d squared_scales = axes.eigenvalues();
  const double foreshortening =
      0.5 * std::log(squared_scales[1] / std::max(squared_scales[0], 1e-12 * squared_scales[1]));
  const double direction = 2 * std::atan2(axes.eigenvectors()(1, 1), axes.eigenvectors()(0, 1));
  const double image_px = std::sqrt(static_cast<double>(image_size.area()));
  std::vector<cv::Point2f> hull;
  cv::convexHull(view.pixels, hull);
  const double half_px = 0.5 * std::sqrt(cv::contourArea(hull));
  // The relative change of scale from the middle of the board to its border, along the image.
  const Eigen::Vector2d change = half_px * (perspective * J.inverse()).transpose();
  ViewSignature signature;
  signature << pixel.x() / image_size.width, pixel.y() / image_size.height, 2 * half_px / image_px,
      foreshortening * std::cos(direction), foreshortening * std::sin(direction), change;
  return signature;
}

}  // namespace

std::vector<std::size_t> ChooseViews(std::span<const BoardView> views, cv::Size image_size,
                                     std::size_t max_views) {
  std::vector<std::size_t> chosen;
  if (views.empty()) return chosen;
  std::vector<ViewSignature> signatures;
  for (const BoardView& view : views) signatures.push_back(SignatureOf(view, image_size));
  std::vector<double> distance(views.size(), std::numeric_limits<double>::infinity());
  // The largest one first: its corners are spread over the most of the image.
  auto next = static_cast<std::size_t>(
      std::max_element(signatures.begin(), signatures.end(),
                       [](const auto& a, const auto& b) { return a[2] < b[2]; }) -
      signatures.begin());
  while (chosen.size() < max_views) {
    chosen.push_back(next);
    for (std::size_t i = 0; i < views.size(); ++i) {
      distance[i] = std::min(distance[i], (signatures[i] - signatures[next]).norm());
    }
    const auto farthest = std::max_element(distance.begin(), distance.end());
    if (*farthest < kSameView) break;
    next = static_cast<std::size_t>(farthest - distance.begin());
  }
  return chosen;
}

}  // namespace mono3d::calibration
