// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::calibration {
namespace {

// Of the larger side of the image: beyond, a board looks flat or a pinhole camera ends.
constexpr double kMinFocal = 0.1;
constexpr double kMaxFocal = 30;

BoardPose ToBoardPose(const cv::Mat& rotation, const cv::Mat& translation) {
  BoardPose pose = {};
  for (int i = 0; i < 3; ++i) {
    pose[static_cast<std::size_t>(i)] = rotation.at<double>(i);
    pose[static_cast<std::size_t>(3 + i)] = translation.at<double>(i);
  }
  return pose;
}

struct BoardPoints {
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<std::vector<cv::Point2f>> pixels;
};

BoardPoints PointsOf(const std::vector<BoardView>& views) {
  BoardPoints points;
  for (const BoardView& view : views) {
    points.corners.push_back(view.corners);
    points.pixels.push_back(view.pixels);
  }
  return points;
}

// The focal length that the homographies of the views agree with best; else the prior's.
CameraModel StartOf(const CameraPrior& prior, const BoardPoints& points) {
  CameraModel start = prior.camera;
  const cv::Mat K = cv::initCameraMatrix2D(points.corners, points.pixels,
                                           {start.width, start.height}, /*aspectRatio=*/1);
  CameraModel found = start;
  found.fx = K.at<double>(0, 0);
  found.fy = found.fx * start.fy / start.fx;
  return IsPlausible(found) ? found : start;
}

void SolveFreely(BoardProblem& problem) {
  const BoardPoints points = PointsOf(problem.views);
  problem.camera = StartOf(problem.prior, points);
  CameraModel& camera = problem.camera;
  cv::Mat K;
  cv::eigen2cv(camera.Matrix(), K);
  cv::Mat coefficients(std::vector<double>(camera.distortion.begin(), camera.distortion.end()),
                       true);
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  cv::calibrateCamera(points.corners, points.pixels, {camera.width, camera.height}, K, coefficients,
                      rotations, translations, cv::CALIB_USE_INTRINSIC_GUESS,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
  camera.fx = K.at<double>(0, 0);
  camera.fy = K.at<double>(1, 1);
  camera.cx = K.at<double>(0, 2);
  camera.cy = K.at<double>(1, 2);
  for (int i = 0; i < 5; ++i) {
    camera.distortion[static_cast<std::size_t>(i)] = coefficients.at<double>(i);
  }
  problem.poses.clear();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    problem.poses.push_back(ToBoardPose(rotations[i], translations[i]));
  }
}

// From the corners that a pinhole camera would show as well; nothing where these are too few.
std::optional<BoardPose> PoseThroughFisheye(const CameraModel& camera, const FisheyeAngles& angles,
                                            const BoardView& view) {
  constexpr double kMaxAngle_rad = 80 * std::numbers::pi / 180;
  constexpr std::size_t kMinCorners = 6;
  std::vector<cv::Point3f> corners;
  std::vector<cv::Point2d> points;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const cv::Point2d point((view.pixels[i].x - camera.cx) / camera.fx,
                            (view.pixels[i].y - camera.cy) / camera.fy);
    const double radius = std::hypot(point.x, point.y);
    const std::optional<double> angle = angles.At(radius);
    if (!angle || *angle > kMaxAngle_rad) continue;
    corners.push_back(view.corners[i]);
    points.push_back(radius > 0 ? std::tan(*angle) / radius * point : point);
  }
  if (corners.size() < kMinCorners) return std::nullopt;
  cv::Mat rotation;
  cv::Mat translation;
  if (!cv::solvePnP(corners, points, cv::Matx33d::eye(), cv::noArray(), rotation, translation)) {
    return std::nullopt;
  }
  return RefinePose(camera, view, ToBoardPose(rotation, translation));
}

// Returns whether every view has one.
bool FindFisheyePoses(BoardProblem& problem) {
  const FisheyeAngles angles(problem.camera.distortion);
  problem.poses.clear();
  for (const BoardView& view : problem.views) {
    const std::optional<BoardPose> pose = PoseThroughFisheye(problem.camera, angles, view);
    if (!pose) return false;
    problem.poses.push_back(*pose);
  }
  return true;
}

double MedianError_px(const BoardProblem& problem) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const BoardErrors of_view = ErrorsOf(problem.camera, problem.views[i], problem.poses[i]);
    errors.push_back(of_view.observed_less_computed.norm());
  }
  return Median(errors);
}

bool FindFisheyeStart(BoardProblem& problem) {
  double least_px = std::numeric_limits<double>::infinity();
  BoardProblem best = problem;
  for (const double sigmas : {-2., -1., 0., 1., 2.}) {
    const double factor = std::exp(sigmas * problem.prior.focal_sigma);
    BoardProblem candidate = problem;
    candidate.camera = problem.prior.camera;
    candidate.camera.fx *= factor;
    candidate.camera.fy *= factor;
    if (!FindFisheyePoses(candidate)) continue;
    const double error_px = MedianError_px(candidate);
    if (!(error_px < least_px)) continue;
    least_px = error_px;
    best = std::move(candidate);
  }
  problem = std::move(best);
  return std::isfinite(least_px);
}

}  // namespace

bool IsPlausible(const CameraModel& camera) {
  const double side = std::max(camera.width, camera.height);
  // Not a number fails as well.
  return camera.fx > kMinFocal * side && camera.fx < kMaxFocal * side && camera.fy > 0 &&
         std::isfinite(camera.fy) && ToParameters(camera).allFinite();
}

bool FindStart(BoardProblem& problem) {
  if (problem.prior.camera.lens == LensModel::kFisheye) return FindFisheyeStart(problem);
  SolveFreely(problem);
  return IsPlausible(problem.camera);
}

}  // namespace mono3d::calibration
