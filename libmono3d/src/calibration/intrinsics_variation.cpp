// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/intrinsics_variation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "calibration/camera_covariance.h"
#include "calibration/camera_parameters.h"
#include "calibration/camera_solver.h"
#include "mono3d/core/statistics.h"

namespace mono3d::calibration {
namespace {

// The pose of an image, then its log f, cx and cy.
constexpr int kNumOfImage = 9;
using ImageMatrix = Eigen::Matrix<double, kNumOfImage, kNumOfImage>;
using ImageVector = Eigen::Matrix<double, kNumOfImage, 1>;
// Several for each of the nine.
constexpr int kMinObservationsOfImage = 30;
constexpr std::size_t kMinImagesThatVary = 5;
// The errors of the points in one image are not independent: standard deviations are too small by
// 2 to 4.
constexpr double kCorrelated = 4;

// The normal equations of one image's pose and intrinsics.
struct ImageEquations {
  ImageMatrix information = ImageMatrix::Zero();
  ImageVector gradient = ImageVector::Zero();
  double squares = 0;  // of the residuals
  int num_observations = 0;

  // The derivatives of the pixel by log f, cx and cy, in standard deviations.
  void Add(const CameraProblem::Linearised& row, const Eigen::Matrix<double, 2, 3>& by_intrinsics) {
    Eigen::Matrix<double, 2, kNumOfImage> J;
    J << row.by_pose, row.weight * by_intrinsics;
    information += J.transpose() * J;
    gradient += J.transpose() * row.residual;
    squares += row.residual.squaredNorm();
    ++num_observations;
  }
};

// What the images' own values differ by from the common ones, and their standard deviations as if
// all errors were independent.
struct Differences {
  std::vector<double> absolute;
  std::vector<double> sigma;

  // 0 where it is within chance or `tolerance`.
  double Spread(double tolerance) const {
    constexpr double kMedianToSigma = 1.4826;
    const double spread = kMedianToSigma * UpperMedianOrZero(absolute);
    return spread > std::max(tolerance, kCorrelated * UpperMedianOrZero(sigma)) ? spread : 0;
  }
};

// Stretches of so many images tell their focal length, and no more than four of them are compared:
// a problem has kMaxImages images.
constexpr std::size_t kMinImagesOfStretch = 6;
constexpr std::size_t kMaxStretches = 4;
// Less is within what a map that was tracked with a wrong camera is bent by.
constexpr double kSteadyStretches = 0.03;

// Image::camera becomes the stretch; the number of stretches.
std::size_t DivideIntoStretches(std::vector<SparseModel>& maps) {
  std::vector<SparseImage*> images;
  for (SparseModel& map : maps) {
    const std::size_t first = images.size();
    for (SparseImage& image : map.images) images.push_back(&image);
    std::sort(images.begin() + static_cast<std::ptrdiff_t>(first), images.end(),
              [](const SparseImage* a, const SparseImage* b) { return a->id < b->id; });
  }
  const std::size_t num = std::min(kMaxStretches, images.size() / kMinImagesOfStretch);
  for (std::size_t i = 0; i < images.size() && num > 0; ++i) {
    images[i]->camera = i * num / images.size();
  }
  for (SparseModel& map : maps) {
    map.further_cameras.assign(std::max<std::size_t>(num, 1) - 1, map.camera);
  }
  return num;
}

}  // namespace

double MeasureFocalDrift(std::vector<SparseModel> maps, const CameraModel& camera) {
  constexpr std::size_t kNumPoints = 1000;
  constexpr double kFreeFocal = 0.5;  // a zoom of any size
  const std::size_t num_stretches = DivideIntoStretches(maps);
  if (num_stretches < 2) return 0;
  CameraPrior prior = DefaultCameraPrior(camera.width, camera.height, camera.lens);
  prior.camera = camera;
  prior.focal_sigma = kFreeFocal;
  const std::vector<CameraModel> starts(num_stretches, camera);
  const std::vector<CameraPrior> priors(num_stretches, prior);
  CameraProblem problem({.maps = maps, .max_points = kNumPoints}, starts, priors);
  if (problem.num_points() == 0) return 0;
  ParameterFlags held = ParameterFlags::Constant(true);
  held[kLogFocal] = false;
  for (std::size_t i = 0; i < num_stretches; ++i) problem.FixAtPrior(held, i);
  for (const double min_gain : {1e-2, 1e-4}) Solve(problem, min_gain);
  const std::vector<CameraCovariance> covariances = CameraCovariances(problem);
  // The two that differ most, of those that differ beyond chance.
  double largest = 0;
  for (std::size_t a = 0; a < num_stretches; ++a) {
    for (std::size_t b = a + 1; b < num_stretches; ++b) {
      double variance = 0;
      for (const std::size_t i : {a, b}) {
        variance +=
            covariances[i].clustered(kLogFocal, kLogFocal) + covariances[i].hidden[kLogFocal];
      }
      const double difference =
          std::abs(problem.parameters(a)[kLogFocal] - problem.parameters(b)[kLogFocal]);
      if (!(variance > 0) || difference < kCorrelated * std::sqrt(variance)) continue;
      largest = std::max(largest, difference);
    }
  }
  return largest > kSteadyStretches ? std::expm1(largest) : 0;
}

IntrinsicsVariation MeasureIntrinsicsVariation(const CameraProblem& problem,
                                               std::size_t of_camera) {
  // Of the larger side, and of the focal length: what good calibrations of one camera differ by.
  constexpr double kSteadyPrincipalPoint = 0.001;
  constexpr double kSteadyFocal = 0.003;
  const CameraModel camera = problem.camera(of_camera);
  std::vector<ImageEquations> images(problem.num_images());
  for (const CameraProblem::Observation& observation : problem.observations()) {
    if (observation.is_flow || problem.camera_of(observation) != of_camera) continue;
    const CameraProblem::Linearised row = problem.Linearise(observation);
    Eigen::Matrix<double, 2, 3> by_intrinsics;
    by_intrinsics << observation.measured - Eigen::Vector2d(camera.cx, camera.cy),
        Eigen::Matrix2d::Identity();
    images[observation.image].Add(row, by_intrinsics / problem.sigma_px());
  }
  Differences focal;
  Differences centre;
  for (const ImageEquations& image : images) {
    if (image.num_observations < kMinObservationsOfImage) continue;
    const Eigen::LDLT<ImageMatrix> solver(image.information);
    const ImageVector difference = -solver.solve(image.gradient);
    // Of what is left then: the residuals before are larger for the variation itself.
    const double squares_left = image.squares + image.gradient.dot(difference);
    const double variance = squares_left / (2 * image.num_observations - kNumOfImage);
    const ImageMatrix covariance = variance * solver.solve(ImageMatrix::Identity());
    if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0) continue;
    focal.absolute.push_back(std::abs(difference[6]));
    focal.sigma.push_back(std::sqrt(covariance(6, 6)));
    for (const int i : {7, 8}) {
      centre.absolute.push_back(std::abs(difference[i]));
      centre.sigma.push_back(std::sqrt(covariance(i, i)));
    }
  }
  if (focal.absolute.size() < kMinImagesThatVary) return {};
  return {centre.Spread(kSteadyPrincipalPoint * std::max(camera.width, camera.height)),
          focal.Spread(kSteadyFocal)};
}

}  // namespace mono3d::calibration
