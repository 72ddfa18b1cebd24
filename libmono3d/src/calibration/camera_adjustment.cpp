// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/camera_covariance.h"
#include "calibration/camera_problem.h"
#include "calibration/camera_solver.h"
#include "calibration/intrinsics_variation.h"
#include "calibration/parameter_choice.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/undistorter.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinImages = 3;
constexpr std::size_t kMinPoints = 50;
// Rounds of weights: the first residuals are those of a wrong camera. The last gain is less than a
// hundredth of what one standard deviation of a parameter costs.
constexpr std::array<double, 3> kMinGains = {1e-2, 1e-4, 1e-6};
// Rolling shutters take 5 ms and more; what is found below is what the model leaves out.
constexpr double kLeastReadout_s = 0.001;
// Of the image's larger side: the residuals of a good calibration, 0.3 px in 1,000.
constexpr double kToldTolerance = 0.0003;

// Lines run along the longer side of a sensor, and so of the image, turned or not.
Parameter UsualReadout(const CameraModel& camera) {
  return camera.width >= camera.height ? kReadoutByRows : kReadoutByColumns;
}

void SolveAll(CameraProblem& problem) {
  for (const double min_gain : kMinGains) Solve(problem, min_gain);
}

// With one readout time held at the prior.
CameraProblem WithReadoutHeld(CameraProblem problem, Parameter readout) {
  ParameterFlags held = ParameterFlags::Constant(false);
  held[readout] = true;
  problem.FixAtPrior(held);
  SolveAll(problem);
  return problem;
}

// A flight along the lines' order stretches the image as pixels do that are not quite square, from
// resizing to whole pixels: is a readout time found beyond doubt when fy / fx is free as well? The
// rounding is by up to a pixel, as video has even sizes: 0.58 px of the smaller side.
bool HoldsWithFreeAspect(CameraProblem problem, Parameter readout) {
  constexpr double kRoundingSigma_px = 0.58;
  constexpr double kDoubtless = 3;  // in sigmas
  const double with_fixed_aspect = problem.parameters()[readout];
  const CameraModel camera = problem.camera();
  problem.Free(kLogAspect, kRoundingSigma_px / std::min(camera.width, camera.height));
  Solve(problem, kMinGains.back());
  const double sigma = std::sqrt(CameraCovariances(problem).front().clustered(readout, readout));
  const double found = problem.parameters()[readout];
  return std::abs(found) > kDoubtless * sigma &&
         std::abs(found) > 0.5 * std::abs(with_fixed_aspect);
}

// Rays through the middle, the corners and the middles of the borders of an image.
class RayGrid {
 public:
  using Pixels = Eigen::Matrix<double, 18, 1>;
  using Jacobian = Eigen::Matrix<double, 18, kNumParameters>;
  using Covariance = Eigen::Matrix<double, 18, 18>;

  explicit RayGrid(const CameraModel& camera) {
    const CameraModel linear = PinholeOfField(camera);
    std::size_t i = 0;
    for (const double x : {0., 0.5, 1.}) {
      for (const double y : {0., 0.5, 1.}) {
        rays_[i++] = linear.Unproject({x * (camera.width - 1), y * (camera.height - 1)});
      }
    }
  }

  // Where the camera shows them.
  Pixels Project(const CameraModel& camera) const {
    Pixels pixels;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      pixels.segment<2>(2 * static_cast<Eigen::Index>(i)) = ProjectDistorted(camera, rays_[i]);
    }
    return pixels;
  }

  Jacobian ByParameters(const CameraModel& camera) const {
    constexpr double kStep = 1e-6;
    const ParameterVector parameters = ToParameters(camera);
    Jacobian J;
    for (int i = 0; i < kNumParameters; ++i) {
      ParameterVector moved = parameters;
      moved[i] += kStep;
      J.col(i) = (Project(WithParameters(camera, moved)) - Project(camera)) / kStep;
    }
    return J;
  }

 private:
  std::array<Eigen::Vector3d, 9> rays_;
};

// What the images tell better than the prior does. The focal length has to be known as well where
// what the model leaves out is alike in all images: along a straight flight that looks straight
// down any focal length fits, with the ground farther away, and noise in the poses makes one of
// them seem better (an error that all observations share). About .3 % for 25 photographs of a
// church, 6 % for 18 straight down over flat ground.
ParameterFlags DeterminedOf(const CameraProblem& problem, std::size_t camera,
                            const CameraCovariance& covariance) {
  const ParameterVector& sigmas = problem.prior_sigmas(camera);
  ParameterFlags is_determined = DeterminedParameters(covariance.clustered, sigmas);
  if (!problem.is_fixed(camera)[kLogFocal]) {
    const ParameterMatrix hidden = covariance.hidden.asDiagonal();
    is_determined[kLogFocal] =
        is_determined[kLogFocal] && DeterminedParameters(hidden, sigmas)[kLogFocal];
  }
  return is_determined;
}

// How well the parameters are known. Where a wrong focal length could hide, a wrong distortion
// could as well: straight down on flat ground a lens that bends the heights is told by what the
// model leaves out alone.
ParameterMatrix UncertaintyOf(const CameraProblem& problem, std::size_t camera,
                              const CameraCovariance& covariance,
                              const ParameterFlags& is_determined) {
  const bool is_hidden = !problem.is_fixed(camera)[kLogFocal] && !is_determined[kLogFocal];
  ParameterMatrix uncertainty = covariance.clustered;
  if (is_hidden) uncertainty += covariance.hidden.asDiagonal();
  return uncertainty;
}

// What is free and stays better where the prior has it: what the images do not tell, and what
// differs from the prior's by no more than chance.
ParameterFlags ToHold(const CameraProblem& problem, std::size_t camera,
                      const ParameterMatrix& covariance, const ParameterFlags& is_determined) {
  const ParameterFlags is_like_prior = ParametersLikePrior(
      problem.camera(camera).lens, problem.parameters(camera) - problem.prior(camera), covariance,
      problem.is_fixed(camera), kChi2At99);
  return (!is_determined || is_like_prior) && !problem.is_fixed(camera);
}

// After some parameters were held: until the weights have settled, which are those of residuals
// that the others no longer explain at first.
void SolveAgain(CameraProblem& problem) {
  constexpr std::size_t kMaxRounds = 10;
  constexpr double kSettledShare = 0.01;  // of a weight
  double before = 0;
  for (std::size_t round = 0; round < kMaxRounds; ++round) {
    Solve(problem, kMinGains.at(std::min(round, kMinGains.size() - 1)));
    const bool is_settled = std::abs(problem.sigma_px() - before) < kSettledShare * before;
    if (round + 1 >= kMinGains.size() && is_settled) break;
    before = problem.sigma_px();
  }
}

// The uncertainty is that with all free.
CameraAdjustment ResultOf(const CameraProblem& problem, std::size_t camera,
                          const ParameterMatrix& covariance, const ParameterFlags& is_determined) {
  CameraAdjustment result;
  result.camera = problem.camera(camera);
  result.covariance = WithPriorVariance(covariance, is_determined, problem.prior_sigmas(camera));
  result.is_determined = is_determined;
  result.sigma_px = problem.sigma_px();
  result.num_images = problem.NumImagesOf(camera);
  result.num_points = problem.num_points();
  result.num_observations = problem.NumObservationsOf(camera);
  result.num_positions = problem.NumPositionsOf(camera);
  result.variation = MeasureIntrinsicsVariation(problem, camera);
  result.residuals = problem.Residuals(camera);
  return result;
}

// Is what was found of a readout time none? Where the images would be explained as well without it,
// but for a hundredth of the variance of their residuals, it is taken for what the model leaves out
// in all of them alike: straight down and on at even speed it only stretches the ground.
bool IsNoReadout(const CameraProblem& problem, Parameter readout, const CameraCovariance& known) {
  const double found_s = problem.parameters()[readout];
  const double by_chance_s2 = kChi2At99.front() * known.clustered(readout, readout);
  return std::abs(found_s) < kLeastReadout_s ||
         found_s * found_s < by_chance_s2 + known.hidden[readout];
}

// Of photos: what cannot be told apart from what the model leaves out.
ParameterFlags NotOfPhotos(std::size_t num_photos) {
  ParameterFlags held = ParameterFlags::Constant(num_photos < kMinImages);
  for (const Parameter main : {kLogFocal, kCx, kCy, kK1}) held[main] = false;
  held[kReadoutByRows] = held[kReadoutByColumns] = true;
  return held;
}

std::vector<CameraAdjustment> AdjustCamerasOnce(std::span<const CameraPrior> priors,
                                                std::span<const CameraModel> starts,
                                                const CalibrationMaps& maps) {
  std::vector<CameraAdjustment> results(starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) results[i].camera = starts[i];
  CameraProblem problem(maps, starts, priors);
  if (problem.num_images() < kMinImages || problem.num_points() < kMinPoints) return results;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    problem.FixAtPrior(NotOfPhotos(problem.NumImagesOf(i)), i);
  }
  SolveAll(problem);
  const std::vector<CameraCovariance> covariances = CameraCovariances(problem);
  std::vector<ParameterFlags> is_determined;
  std::vector<ParameterMatrix> uncertainties;
  bool is_held = false;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    is_determined.emplace_back(DeterminedOf(problem, i, covariances[i]) && !problem.is_fixed(i));
    uncertainties.push_back(UncertaintyOf(problem, i, covariances[i], is_determined[i]));
    const ParameterFlags held = ToHold(problem, i, uncertainties[i], is_determined[i]);
    problem.FixAtPrior(held, i);
    is_held = is_held || held.any();
  }
  if (is_held) SolveAgain(problem);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (problem.NumObservationsOf(i) == 0) continue;
    results[i] = ResultOf(problem, i, uncertainties[i], is_determined[i]);
  }
  return results;
}

bool IsLens(const CameraModel& camera) {
  try {
    (void)Undistorter(camera);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              const CalibrationMaps& maps) {
  CameraAdjustment result;
  result.camera = start;
  CameraProblem problem(maps, start, prior);
  if (problem.num_images() < kMinImages || problem.num_points() < kMinPoints) return result;
  SolveAll(problem);
  const CameraProblem with_both = problem;
  const Parameter larger = problem.HoldLesserReadout();
  Solve(problem, kMinGains.back());
  if (larger != UsualReadout(start) && prior.aspect_sigma == 0 &&
      !HoldsWithFreeAspect(problem, larger)) {
    problem = WithReadoutHeld(with_both, larger);
  }
  const CameraCovariance known = CameraCovariances(problem).front();
  ParameterFlags is_determined = DeterminedOf(problem, 0, known);
  for (const Parameter readout : {kReadoutByRows, kReadoutByColumns}) {
    if (problem.is_fixed()[readout]) is_determined[readout] = false;
  }
  const ParameterMatrix covariance = UncertaintyOf(problem, 0, known, is_determined);
  ParameterFlags is_held = ToHold(problem, 0, covariance, is_determined);
  for (const Parameter readout : {kReadoutByRows, kReadoutByColumns}) {
    const bool is_none = problem.prior()[readout] == 0 && IsNoReadout(problem, readout, known);
    if (is_none && !problem.is_fixed()[readout]) is_held[readout] = true;
  }
  if (is_held.any()) {
    problem.FixAtPrior(is_held);
    SolveAgain(problem);
  }
  return ResultOf(problem, 0, covariance, is_determined);
}

CameraAdjustment AdjustToLens(CameraPrior prior, const CameraModel& start,
                              const CalibrationMaps& maps) {
  CameraAdjustment adjustment = AdjustCamera(prior, start, maps);
  for (const double k1_sigma : {prior.distortion_sigma[0], 0.}) {
    if (adjustment.num_observations == 0 || IsLens(adjustment.camera)) break;
    prior.distortion_sigma = {k1_sigma, 0, 0, 0, 0};
    adjustment = AdjustCamera(prior, start, maps);
  }
  return adjustment;
}

std::vector<CameraAdjustment> AdjustCameras(std::vector<CameraPrior> priors,
                                            std::span<const CameraModel> starts,
                                            const CalibrationMaps& maps) {
  std::vector<CameraAdjustment> adjustments = AdjustCamerasOnce(priors, starts, maps);
  for (const bool keeps_k1 : {true, false}) {
    bool all_are_lenses = true;
    for (std::size_t i = 0; i < priors.size(); ++i) {
      if (adjustments[i].num_observations == 0 || IsLens(adjustments[i].camera)) continue;
      all_are_lenses = false;
      const double k1_sigma = keeps_k1 ? priors[i].distortion_sigma[0] : 0;
      priors[i].distortion_sigma = {k1_sigma, 0, 0, 0, 0};
    }
    if (all_are_lenses) break;
    adjustments = AdjustCamerasOnce(priors, starts, maps);
  }
  return adjustments;
}

double LargestUncertainty_px(const CameraModel& camera, const ParameterMatrix& covariance) {
  const RayGrid::Jacobian J = RayGrid(camera).ByParameters(camera);
  const RayGrid::Covariance of_pixels = J * covariance * J.transpose();
  double largest = 0;
  for (Eigen::Index i = 0; i < of_pixels.rows(); i += 2) {
    largest = std::max(largest, std::sqrt(of_pixels(i, i) + of_pixels(i + 1, i + 1)));
  }
  return largest;
}

bool Contradicts(const CameraAdjustment& adjustment, const CameraPrior& told) {
  // Among the directions in which nine rays may differ, that of the focal length is one of many.
  const double focal_difference = std::log(adjustment.camera.fx / told.camera.fx);
  const double focal_variance =
      told.focal_sigma * told.focal_sigma + adjustment.covariance(kLogFocal, kLogFocal);
  if (focal_difference * focal_difference > kChi2At99.front() * focal_variance) return true;
  const RayGrid grid(told.camera);
  const RayGrid::Jacobian J = grid.ByParameters(adjustment.camera);
  RayGrid::Covariance covariance = J * adjustment.covariance * J.transpose();
  const RayGrid::Pixels by_focal = told.focal_sigma * J.col(kLogFocal);
  covariance += by_focal * by_focal.transpose();
  const double tolerance_px = kToldTolerance * std::max(told.camera.width, told.camera.height);
  covariance.diagonal().array() += tolerance_px * tolerance_px;
  const RayGrid::Pixels difference = grid.Project(adjustment.camera) - grid.Project(told.camera);
  constexpr double kChi2At999 = 42.31;  // for 18 degrees of freedom, at 99.9 %
  return difference.dot(covariance.ldlt().solve(difference)) > kChi2At999;
}

}  // namespace mono3d::calibration
