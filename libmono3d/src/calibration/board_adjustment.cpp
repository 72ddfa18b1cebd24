// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <vector>

#include "calibration/parameter_choice.h"
#include "mono3d/core/statistics.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinViews = 3;
constexpr double kBadView = 3;  // times the median error of a view
constexpr int kNumPoseParameters = 6;
// Of the larger side of the image: beyond, a board looks flat or a pinhole camera ends.
constexpr double kMinFocal = 0.1;
constexpr double kMaxFocal = 30;

struct BoardProblem {
  CameraPrior prior;
  std::vector<BoardView> views;
  CameraModel camera;
  std::vector<cv::Mat> rotations;     // of each view: rotation vector of the board
  std::vector<cv::Mat> translations;  // in squares
};

cv::Mat ToMatrix(const CameraModel& camera) {
  cv::Mat K;
  cv::eigen2cv(camera.Matrix(), K);
  return K;
}

cv::Mat ToCoefficients(const CameraModel& camera) {
  return cv::Mat(std::vector<double>(camera.distortion.begin(), camera.distortion.end()), true);
}

bool IsPlausible(const CameraModel& camera) {
  const double side = std::max(camera.width, camera.height);
  // Not a number fails as well.
  return camera.fx > kMinFocal * side && camera.fx < kMaxFocal * side && camera.fy > 0 &&
         std::isfinite(camera.fy) && ToParameters(camera).allFinite();
}

// The focal length that the homographies of the views agree with best; else the prior's.
CameraModel StartOf(const CameraPrior& prior, std::span<const BoardView> views) {
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : views) {
    corners.push_back(view.corners);
    pixels.push_back(view.pixels);
  }
  CameraModel start = prior.camera;
  const cv::Mat K =
      cv::initCameraMatrix2D(corners, pixels, {start.width, start.height}, /*aspectRatio=*/1);
  CameraModel found = start;
  found.fx = K.at<double>(0, 0);
  found.fy = found.fx * start.fy / start.fx;
  return IsPlausible(found) ? found : start;
}

// All free, without the prior.
void SolveFreely(BoardProblem& problem) {
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : problem.views) {
    corners.push_back(view.corners);
    pixels.push_back(view.pixels);
  }
  CameraModel& camera = problem.camera;
  cv::Mat K = ToMatrix(camera);
  cv::Mat coefficients = ToCoefficients(camera);
  cv::calibrateCamera(corners, pixels, {camera.width, camera.height}, K, coefficients,
                      problem.rotations, problem.translations, cv::CALIB_USE_INTRINSIC_GUESS,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
  camera.fx = K.at<double>(0, 0);
  camera.fy = K.at<double>(1, 1);
  camera.cx = K.at<double>(0, 2);
  camera.cy = K.at<double>(1, 2);
  for (int i = 0; i < 5; ++i) {
    camera.distortion[static_cast<std::size_t>(i)] = coefficients.at<double>(i);
  }
}

// Of the camera as it is.
void SolvePoses(BoardProblem& problem) {
  const cv::Mat K = ToMatrix(problem.camera);
  const cv::Mat coefficients = ToCoefficients(problem.camera);
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const BoardView& view = problem.views[i];
    cv::solvePnPRefineLM(view.corners, view.pixels, K, coefficients, problem.rotations[i],
                         problem.translations[i],
                         {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 1e-12});
  }
}

// Of one view; and its derivatives where asked for.
std::vector<CalibrationResidual> ResidualsOf(const BoardProblem& problem, std::size_t index,
                                             cv::Mat* jacobian = nullptr) {
  const BoardView& view = problem.views[index];
  std::vector<cv::Point2f> computed;
  cv::Mat derivatives;
  cv::projectPoints(view.corners, problem.rotations[index], problem.translations[index],
                    ToMatrix(problem.camera), ToCoefficients(problem.camera), computed,
                    derivatives);
  if (jacobian != nullptr) *jacobian = derivatives;
  std::vector<CalibrationResidual> residuals;
  for (std::size_t i = 0; i < computed.size(); ++i) {
    const cv::Point2f error = view.pixels[i] - computed[i];
    residuals.push_back({{view.pixels[i].x, view.pixels[i].y}, {error.x, error.y}});
  }
  return residuals;
}

// What one view says of the camera once its own pose is free: information and gradient, in px.
struct ViewInformation {
  ParameterMatrix information = ParameterMatrix::Zero();
  ParameterVector gradient = ParameterVector::Zero();
};

ViewInformation InformationOf(const BoardProblem& problem, std::size_t index,
                              const ParameterFlags& is_held) {
  cv::Mat derivatives;
  const std::vector<CalibrationResidual> residuals = ResidualsOf(problem, index, &derivatives);
  Eigen::MatrixXd J;  // rotation (3), translation (3), fx fy, cx cy, k1 k2 p1 p2 k3
  cv::cv2eigen(derivatives, J);
  Eigen::VectorXd error(J.rows());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    error.segment<2>(static_cast<Eigen::Index>(2 * i)) = residuals[i].error_px;
  }
  const Eigen::MatrixXd by_pose = J.leftCols<kNumPoseParameters>();
  Eigen::MatrixXd by_camera = Eigen::MatrixXd::Zero(J.rows(), kNumParameters);
  by_camera.col(kLogFocal) = problem.camera.fx * J.col(6) + problem.camera.fy * J.col(7);
  by_camera.col(kLogAspect) = problem.camera.fy * J.col(7);
  by_camera.middleCols<7>(kCx) = J.middleCols<7>(8);
  for (int i = 0; i < kNumParameters; ++i) {
    if (is_held[i]) by_camera.col(i).setZero();
  }
  const auto pose_information = (by_pose.transpose() * by_pose).eval().ldlt();
  const Eigen::MatrixXd free =
      by_camera - by_pose * pose_information.solve(by_pose.transpose() * by_camera);
  return {free.transpose() * by_camera, free.transpose() * error};
}

double ResidualVariance(const BoardProblem& problem, int num_parameters) {
  double sum = 0;
  std::size_t num_coordinates = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    for (const CalibrationResidual& residual : ResidualsOf(problem, i)) {
      sum += residual.error_px.squaredNorm();
      num_coordinates += 2;
    }
  }
  const double num_unknowns =
      static_cast<double>(kNumPoseParameters * problem.views.size()) + num_parameters;
  // A coordinate cannot be measured better than this: interpolation of 8-bit images.
  constexpr double kMinSigma_px = 0.01;
  return std::max(kMinSigma_px * kMinSigma_px,
                  sum / std::max(1., static_cast<double>(num_coordinates) - num_unknowns));
}

// What all views and the prior say; in sigmas. Rows of what is held are those of the unit matrix.
struct BoardInformation {
  ParameterMatrix information = ParameterMatrix::Zero();
  ParameterVector gradient = ParameterVector::Zero();
  ParameterMatrix spread = ParameterMatrix::Zero();  // sum of squares of the views' gradients

  ParameterMatrix Covariance(const ParameterFlags& is_held) const {
    ParameterMatrix covariance = information.ldlt().solve(ParameterMatrix::Identity());
    for (int i = 0; i < kNumParameters; ++i) {
      if (!is_held[i]) continue;
      covariance.row(i).setZero();
      covariance.col(i).setZero();
    }
    return covariance;
  }
};

BoardInformation InformationOfAll(const BoardProblem& problem, const ParameterFlags& is_held) {
  const double variance =
      ResidualVariance(problem, kNumParameters - static_cast<int>(is_held.count()));
  BoardInformation result;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const ViewInformation view = InformationOf(problem, i, is_held);
    result.information += view.information / variance;
    result.gradient += view.gradient / variance;
    result.spread += view.gradient * view.gradient.transpose() / (variance * variance);
  }
  const ParameterVector sigmas = PriorSigmas(problem.prior);
  const ParameterVector to_prior =
      ToParameters(problem.prior.camera) - ToParameters(problem.camera);
  for (int i = 0; i < kNumParameters; ++i) {
    const double weight = is_held[i] ? 0 : 1 / (sigmas[i] * sigmas[i]);
    result.information(i, i) += is_held[i] ? 1 : weight;
    result.gradient[i] += weight * to_prior[i];
  }
  return result;
}

// Draws the camera to the prior, and what is held onto it. Returns whether that makes a camera.
bool SolveWithPrior(const ParameterFlags& is_held, BoardProblem& problem) {
  constexpr int kMaxSteps = 20;
  constexpr double kMinStep = 1e-6;  // squared, in sigmas
  problem.camera = WithParameters(problem.camera, is_held.select(ToParameters(problem.prior.camera),
                                                                 ToParameters(problem.camera)));
  for (int i = 0; i < kMaxSteps; ++i) {
    SolvePoses(problem);
    const BoardInformation all = InformationOfAll(problem, is_held);
    const ParameterVector step = all.Covariance(is_held) * all.gradient;
    problem.camera = WithParameters(problem.camera, ToParameters(problem.camera) + step);
    if (!IsPlausible(problem.camera)) return false;
    if (step.dot(all.information * step) < kMinStep) break;
  }
  SolvePoses(problem);
  return true;
}

ParameterMatrix BoardCovariance(const BoardProblem& problem, const ParameterFlags& is_held) {
  const BoardInformation all = InformationOfAll(problem, is_held);
  const ParameterMatrix covariance = all.Covariance(is_held);
  // 1 where the errors of a view are independent; the gradients sum up to nothing, which takes one
  // view of freedom.
  const auto num_views = static_cast<double>(problem.views.size());
  const auto num_free = static_cast<double>(kNumParameters - is_held.count());
  const double overdispersion =
      (covariance * all.spread).trace() / num_free * num_views / (num_views - 1);
  return std::max(1., overdispersion) * covariance;
}

// The covariance when each parameter that is not determined is only as certain as the prior, and
// the others follow it as the views ask for.
ParameterMatrix WithPriorOfUndetermined(const ParameterMatrix& covariance,
                                        const ParameterFlags& is_determined,
                                        const ParameterVector& prior_sigmas) {
  std::vector<Eigen::Index> open;
  for (Eigen::Index i = 0; i < kNumParameters; ++i) {
    if (!is_determined[i] && prior_sigmas[i] > 0) open.push_back(i);
  }
  if (open.empty()) return covariance;
  const Eigen::MatrixXd of_open = covariance(open, open);
  const Eigen::MatrixXd by_open =
      of_open.ldlt().solve(Eigen::MatrixXd(covariance(open, Eigen::all))).transpose();
  const Eigen::MatrixXd prior = prior_sigmas(open).array().square().matrix().asDiagonal();
  return covariance + by_open * (prior - of_open) * by_open.transpose();
}

// Returns whether it left any out.
bool LeaveOutBadViews(BoardProblem& problem) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    double sum = 0;
    for (const CalibrationResidual& residual : ResidualsOf(problem, i)) {
      sum += residual.error_px.squaredNorm();
    }
    errors.push_back(std::sqrt(sum / static_cast<double>(problem.views[i].pixels.size())));
  }
  const double limit = kBadView * Median(errors);
  std::vector<BoardView> good;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    if (errors[i] <= limit) good.push_back(problem.views[i]);
  }
  const bool has_bad = good.size() < problem.views.size();
  problem.views = std::move(good);
  return has_bad;
}

// Until no view is bad. Returns whether that makes a camera.
bool SolveWithGoodViews(BoardProblem& problem) {
  constexpr int kMaxRounds = 5;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (problem.views.size() < kMinViews) return false;
    problem.camera = StartOf(problem.prior, problem.views);
    SolveFreely(problem);
    if (!IsPlausible(problem.camera)) return false;
    if (!LeaveOutBadViews(problem)) return true;
  }
  return false;
}

double SumOfSquares(const BoardProblem& problem) {
  double sum = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    for (const CalibrationResidual& residual : ResidualsOf(problem, i)) {
      sum += residual.error_px.squaredNorm();
    }
  }
  return sum;
}

// Do the views fit as well with another focal length? Of boards that all face the camera the
// covariance at the least residual does not tell: which one that is, is a matter of rounding.
bool LeavesFocalLengthOpen(const BoardProblem& found, const ParameterFlags& is_fixed) {
  if (is_fixed[kLogFocal]) return false;
  constexpr double kOther = 0.3;            // the logarithm: what a camera of chance differs by
  constexpr double kLeastChi2Gain = 10.83;  // one degree of freedom, 99.9 %
  const double variance =
      ResidualVariance(found, kNumParameters - static_cast<int>(is_fixed.count()));
  ParameterFlags is_held = is_fixed;
  is_held[kLogFocal] = true;
  for (const double factor : {std::exp(kOther), std::exp(-kOther)}) {
    BoardProblem other = found;
    for (cv::Mat& rotation : other.rotations) rotation = rotation.clone();
    for (cv::Mat& translation : other.translations) translation = translation.clone();
    other.camera.fx = other.prior.camera.fx = factor * found.camera.fx;
    other.camera.fy = factor * found.camera.fy;
    other.prior.camera.fy = other.camera.fy;
    if (!SolveWithPrior(is_held, other)) continue;
    if (SumOfSquares(other) - SumOfSquares(found) < kLeastChi2Gain * variance) return true;
  }
  return false;
}

void TakeCounts(const BoardProblem& problem, int num_parameters, CameraAdjustment& result) {
  result.camera = problem.camera;
  result.sigma_px = std::sqrt(ResidualVariance(problem, num_parameters));
  result.num_images = problem.views.size();
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const std::vector<CalibrationResidual> residuals = ResidualsOf(problem, i);
    result.residuals.insert(result.residuals.end(), residuals.begin(), residuals.end());
    result.num_points = std::max(result.num_points, problem.views[i].corners.size());
  }
  result.num_observations = result.residuals.size();
}

}  // namespace

CameraAdjustment AdjustBoardCamera(CameraPrior prior, std::span<const BoardView> views) {
  prior.readout_sigma_s = 0;  // boards are held still, their images stand alone
  CameraAdjustment result;
  result.camera = prior.camera;
  const ParameterVector prior_sigmas = PriorSigmas(prior);
  const ParameterFlags is_fixed = prior_sigmas.array() == 0;
  BoardProblem problem{prior, {views.begin(), views.end()}, prior.camera, {}, {}};
  if (!SolveWithGoodViews(problem) || !SolveWithPrior(is_fixed, problem)) return result;
  const ParameterMatrix covariance = BoardCovariance(problem, is_fixed);
  const ParameterFlags is_determined = DeterminedParameters(covariance, prior_sigmas);
  if (!is_determined[kLogFocal] || LeavesFocalLengthOpen(problem, is_fixed)) return result;
  const ParameterVector difference = ToParameters(problem.camera) - ToParameters(prior.camera);
  const ParameterFlags is_held =
      is_fixed || !is_determined ||
      ParametersLikePrior(prior.camera.lens, difference, covariance, is_fixed, kChi2OfAkaike);
  if (is_held.any() && !SolveWithPrior(is_held, problem)) return result;
  TakeCounts(problem, kNumParameters - static_cast<int>(is_held.count()), result);
  result.covariance = WithPriorOfUndetermined(covariance, is_determined, prior_sigmas);
  result.is_determined = is_determined;
  return result;
}

}  // namespace mono3d::calibration
