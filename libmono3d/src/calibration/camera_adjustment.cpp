// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/camera_covariance.h"
#include "calibration/camera_problem.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinImages = 3;
constexpr std::size_t kMinPoints = 50;
// Rounds of weights: the first residuals are those of a wrong camera. The last gain is less than a
// hundredth of what one standard deviation of a parameter costs.
constexpr std::array<double, 3> kMinGains = {1e-2, 1e-4, 1e-6};
// What an adjustment says of a parameter counts where it knows twice as much as the prior did;
// below that the estimate follows what the model leaves out (real lenses, rolling shutters).
constexpr double kMaxShareOfPriorSigma = 0.5;
// Chi-square at 99 %, for one and two degrees of freedom: beyond chance.
constexpr std::array<double, 2> kChi2At99 = {6.63, 9.21};

// Of the image's larger side: the residuals of a good calibration, 0.3 px in 1,000.
constexpr double kToldTolerance = 0.0003;

// Parameters that are held together: without one of a pair the other has no meaning.
using ParameterGroup = std::vector<Eigen::Index>;

void SolveAll(CameraProblem& problem) {
  for (const double min_gain : kMinGains) problem.Solve(min_gain);
}

// How far the group lies from the prior, as a share of what chance allows.
double Significance(const ParameterGroup& group, const ParameterVector& difference,
                    const ParameterMatrix& covariance) {
  const Eigen::VectorXd of_group = difference(group);
  const Eigen::MatrixXd its_covariance = covariance(group, group);
  return of_group.dot(its_covariance.ldlt().solve(of_group)) / kChi2At99[group.size() - 1];
}

// Backward elimination: which free parameters the images do not tell from the prior's. Each one
// that is left free for nothing makes the others less certain, and follows what the model leaves
// out. Higher terms go before lower ones that mean something without them.
ParameterFlags NotTold(const CameraProblem& problem, ParameterMatrix covariance) {
  std::vector<ParameterGroup> groups = {{kK3}, {kK2}, {kP1, kP2}, {kCx, kCy}, {kK1}, {kLogAspect}};
  std::erase_if(groups,
                [&](const ParameterGroup& group) { return problem.is_fixed()[group.front()]; });
  ParameterFlags held = ParameterFlags::Constant(false);
  ParameterVector difference = problem.parameters() - problem.prior();
  while (!groups.empty()) {
    std::vector<double> significance;
    for (const ParameterGroup& group : groups) {
      significance.push_back(Significance(group, difference, covariance));
    }
    const auto least = std::min_element(significance.begin(), significance.end());
    if (*least > 1) break;
    const auto position = least - significance.begin();
    const ParameterGroup group = groups[static_cast<std::size_t>(position)];
    groups.erase(groups.begin() + position);
    for (const Eigen::Index i : group) held[i] = true;
    // The others, given that these are the prior's.
    const Eigen::MatrixXd gain =
        covariance(Eigen::all, group) *
        covariance(group, group)
            .eval()
            .ldlt()
            .solve(Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(group.size()),
                                             static_cast<Eigen::Index>(group.size())));
    difference -= gain * difference(group).eval();
    covariance -= (gain * covariance(group, Eigen::all)).eval();
  }
  return held;
}

// Rays through the middle, the corners and the middles of the borders of an image.
class RayGrid {
 public:
  using Pixels = Eigen::Matrix<double, 18, 1>;
  using Jacobian = Eigen::Matrix<double, 18, kNumParameters>;
  using Covariance = Eigen::Matrix<double, 18, 18>;

  explicit RayGrid(const CameraModel& camera) {
    CameraModel linear = camera;
    linear.distortion = {};
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

}  // namespace

CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              std::span<const SparseModel> maps) {
  CameraAdjustment result;
  result.camera = start;
  CameraProblem problem(maps, start, prior);
  if (problem.num_images() < kMinImages || problem.num_points() < kMinPoints) return result;
  const ParameterVector prior_sigmas = PriorSigmas(prior);
  SolveAll(problem);
  ParameterMatrix covariance = CameraCovariance(problem);
  const ParameterFlags is_determined =
      covariance.diagonal().array().sqrt() < kMaxShareOfPriorSigma * prior_sigmas.array();
  const ParameterFlags is_held =
      (!is_determined || NotTold(problem, covariance)) && !problem.is_fixed();
  if (is_held.any()) {
    problem.FixAtPrior(is_held);
    for (const double min_gain : {1e-4, 1e-6}) problem.Solve(min_gain);
  }
  // What is held where the prior has it is not known better for that: the uncertainty is that with
  // all free.
  for (int i = 0; i < kNumParameters; ++i) {
    if (is_determined[i] || prior_sigmas[i] == 0) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = prior_sigmas[i] * prior_sigmas[i];
  }
  result.camera = problem.camera();
  result.covariance = covariance;
  result.is_determined = is_determined;
  result.sigma_px = problem.sigma_px();
  result.num_images = problem.num_images();
  result.num_points = problem.num_points();
  result.num_observations = problem.observations().size();
  return result;
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
