// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_problem.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <utility>

#include "calibration/flow_cost.h"
#include "calibration/reprojection_cost.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "tracking/optimisation/chi2.h"

namespace mono3d::calibration {
namespace {

constexpr std::size_t kMinObservations = 3;  // of a point: two images agree on any camera
// Of the residuals' robust standard deviation: the loss of Cauchy has 95 % of the efficiency of
// least squares there.
constexpr double kLossScale = 2.385;
// Of a position's error of three coordinates, in standard deviations.
const double kPositionLossScale = std::sqrt(tracking::kChi2ThreeDof);
constexpr double kMadToSigma = 1.4826;
constexpr double kRoundingOfShares = 1e-9;
// Of how an image moves: differences of poses do not follow a shake of some hertz to better.
constexpr double kVelocityShare = 0.01;

using CentreCost = ceres::AutoDiffCostFunction<tracking::CentreError, 3, 6>;

CameraProblem::PoseBlock ToPoseBlock(const Pose& T_cam_axes) {
  CameraProblem::PoseBlock block = {};
  const Eigen::AngleAxisd turn(T_cam_axes.rotation());
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  std::copy_n(rotation.data(), 3, block.data());
  std::copy_n(T_cam_axes.translation().data(), 3, block.data() + 3);
  return block;
}

// The axes of a map's measured positions, and these in them.
struct MetricAxes {
  Similarity S_axes_map;
  std::vector<std::pair<std::size_t, tracking::CentreError>> centres;  // of which image
};

// Do positions determine all three rotations? Their second largest spread is then beyond what they
// are off by.
bool AreOnALine(const std::vector<std::pair<std::size_t, tracking::CentreError>>& centres) {
  constexpr double kBeyondChance = 3;  // in standard deviations
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double sum_of_variances = 0;
  for (const auto& [image, centre] : centres) {
    sum += centre.p_m;
    sum_of_variances += centre.weight.cwiseInverse().cwiseAbs2().mean();
  }
  const auto count = static_cast<double>(centres.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& [image, centre] : centres) {
    const Eigen::Vector3d from_middle = centre.p_m - sum / count;
    scatter += from_middle * from_middle.transpose();
  }
  const double second =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly)
          .eigenvalues()[1];
  return !(second > kBeyondChance * kBeyondChance * sum_of_variances);
}

// Nothing where the positions do not hold the map: fewer than three, on a line, or without heights.
std::optional<MetricAxes> MetricAxesOf(const SparseModel& map,
                                       const std::vector<std::size_t>& images,
                                       const CameraPositions& positions) {
  constexpr std::size_t kFewest = 3;
  if (!positions.has_vertical) return std::nullopt;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  for (const std::size_t i : images) {
    middle_m += positions.S_metric_map * map.images[i].T_world_cam.translation();
  }
  middle_m /= static_cast<double>(images.size());
  MetricAxes axes;
  axes.S_axes_map =
      Similarity(1, Pose(Eigen::Quaterniond::Identity(), -middle_m)) * positions.S_metric_map;
  for (std::size_t k = 0; k < images.size(); ++k) {
    const auto measured = std::ranges::find(positions.positions, map.images[images[k]].id,
                                            &CameraPosition::frame_index);
    if (measured == positions.positions.end() || !(measured->sigma_m.minCoeff() > 0)) continue;
    axes.centres.emplace_back(
        k, tracking::CentreError{measured->p_m - middle_m, tracking::WeightOf(measured->sigma_m)});
  }
  if (axes.centres.size() < kFewest || AreOnALine(axes.centres)) return std::nullopt;
  return axes;
}

// Of each coordinate.
std::vector<double> AbsoluteErrors_px(const std::vector<CalibrationResidual>& residuals) {
  std::vector<double> errors;
  errors.reserve(2 * residuals.size());
  for (const CalibrationResidual& residual : residuals) {
    for (const double error : residual.error_px) errors.push_back(std::abs(error));
  }
  return errors;
}

}  // namespace

CameraProblem::FreeCamera::FreeCamera(const CameraModel& start, const CameraPrior& camera_prior)
    : prior(ToParameters(camera_prior.camera)),
      prior_sigmas(PriorSigmas(camera_prior)),
      is_fixed(prior_sigmas.array() == 0),
      shape(start) {}

CameraProblem::CameraProblem(const CalibrationMaps& maps, const CameraModel& start,
                             const CameraPrior& prior)
    : CameraProblem(maps, std::span(&start, 1), std::span(&prior, 1)) {}

CameraProblem::CameraProblem(const CalibrationMaps& maps, std::span<const CameraModel> starts,
                             std::span<const CameraPrior> priors) {
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const FreeCamera& camera = cameras_.emplace_back(starts[i], priors[i]);
    unknowns_.cameras.emplace_back(camera.is_fixed.select(camera.prior, ToParameters(starts[i])));
  }
  if (maps.maps.empty()) return;
  std::size_t num_images = 0;
  for (const SparseModel& map : maps.maps) num_images += map.images.size();
  const double share = std::min(1., static_cast<double>(kMaxImages) /
                                        static_cast<double>(std::max<std::size_t>(num_images, 1)));
  const std::size_t max_points = maps.max_points / maps.maps.size();
  for (std::size_t i = 0; i < maps.maps.size(); ++i) {
    const auto measured =
        std::ranges::find(maps.positions, static_cast<int>(i), &CameraPositions::map_id);
    Add(maps.maps[i], ChooseImages(maps.maps[i], share),
        measured == maps.positions.end() ? nullptr : &*measured, max_points);
  }
}

std::vector<std::size_t> CameraProblem::ChooseImages(const SparseModel& map, double share) const {
  std::vector<double> num_left(cameras_.size(), 0);  // to be chosen
  for (const SparseImage& image : map.images) num_left[image.camera] += share;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < map.images.size(); ++i) {
    double& left = num_left[map.images[i].camera];
    if (!(left > kRoundingOfShares)) continue;
    left -= 1;
    chosen.push_back(i);
  }
  return chosen;
}

void CameraProblem::Add(const SparseModel& map, const std::vector<std::size_t>& images,
                        const CameraPositions* positions, std::size_t max_points) {
  if (images.size() < 2) return;
  const std::size_t first_image = unknowns_.poses.size();
  const std::size_t first_point = unknowns_.points.size();
  const std::optional<MetricAxes> metric =
      positions != nullptr ? MetricAxesOf(map, images, *positions) : std::nullopt;
  const Similarity S_axes_map =
      metric ? metric->S_axes_map : Similarity(1, map.images[images.front()].T_world_cam.Inverse());
  for (const std::size_t i : images) {
    unknowns_.poses.push_back(ToPoseBlock((S_axes_map * map.images[i].T_world_cam).Inverse()));
    CameraVelocity velocity = map.images[i].velocity.value_or(CameraVelocity());
    velocity.linear_su_per_s *= S_axes_map.scale();
    velocities_.push_back({velocity, 0});
    unknowns_.velocity_changes.push_back({});
    camera_of_image_.push_back(map.images[i].camera);
  }
  AddPoints(map, images, S_axes_map, first_image, max_points);
  if (unknowns_.points.size() == first_point) {
    unknowns_.poses.resize(first_image);
    velocities_.resize(first_image);
    unknowns_.velocity_changes.resize(first_image);
    camera_of_image_.resize(first_image);
    return;
  }
  AddFlows(map, images, first_image);
  if (!metric) {
    ChooseGauge(first_image);
    return;
  }
  for (const auto& [image, error] : metric->centres) {
    positions_.push_back({first_image + image, error});
  }
}

void CameraProblem::AddPoints(const SparseModel& map, const std::vector<std::size_t>& images,
                              const Similarity& S_axes_map, std::size_t first_image,
                              std::size_t max_points) {
  std::vector<std::vector<Observation>> of_point(map.points.size());
  for (std::size_t image = first_image; image < unknowns_.poses.size(); ++image) {
    const SparseImage& shown = map.images[images[image - first_image]];
    const Pose T_cam_world = shown.T_world_cam.Inverse();
    for (const SparseObservation& observation : shown.observations) {
      if (!observation.point) continue;
      const Eigen::Vector3d p_cam = T_cam_world * map.points[*observation.point].p_world;
      if (p_cam.z() <= 0) continue;
      of_point[*observation.point].push_back({image, 0, observation.pixel});
    }
  }
  std::vector<std::size_t> order(of_point.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{},
                           [&](std::size_t i) { return of_point[i].size(); });
  order.resize(std::min(order.size(), max_points));
  for (const std::size_t i : order) {
    if (of_point[i].size() < kMinObservations) break;
    for (Observation& observation : of_point[i]) {
      observation.point = unknowns_.points.size();
      observations_.push_back(observation);
    }
    const Eigen::Vector3d p_axes = S_axes_map * map.points[i].p_world;
    unknowns_.points.push_back({p_axes.x(), p_axes.y(), p_axes.z()});
  }
}

std::size_t CameraProblem::NumImagesOf(std::size_t camera) const {
  return static_cast<std::size_t>(std::ranges::count(camera_of_image_, camera));
}

std::size_t CameraProblem::NumObservationsOf(std::size_t camera) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      observations_,
      [&](const Observation& seen) { return !seen.is_flow && camera_of(seen) == camera; }));
}

std::size_t CameraProblem::NumPositionsOf(std::size_t camera) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      positions_, [&](const MeasuredCentre& of) { return camera_of_image_[of.image] == camera; }));
}

// The largest coordinate of the image that is furthest from the first.
void CameraProblem::ChooseGauge(std::size_t first_image) {
  held_images_.push_back(first_image);
  HeldCoordinate held{first_image + 1, 3};
  double largest = -1;
  for (std::size_t i = first_image + 1; i < unknowns_.poses.size(); ++i) {
    for (int k = 3; k < 6; ++k) {
      const double length = std::abs(unknowns_.poses[i][static_cast<std::size_t>(k)]);
      if (length <= largest) continue;
      largest = length;
      held = {i, k};
    }
  }
  held_coordinates_.push_back(held);
}

std::array<const double*, 4> CameraProblem::ParametersOf(const Observation& observation) const {
  return {unknowns_.cameras[camera_of(observation)].data(),
          unknowns_.poses[observation.image].data(), unknowns_.points[observation.point].data(),
          unknowns_.velocity_changes[observation.image].data()};
}

ReprojectionCost CameraProblem::CostOf(const Observation& observation, double sigma_px) const {
  return {cameras_[camera_of(observation)].shape, observation.measured, sigma_px,
          velocities_[observation.image].known};
}

FlowCost CameraProblem::FlowCostOf(const Observation& observation, double sigma) const {
  return {cameras_[camera_of(observation)].shape.lens, observation.measured, sigma,
          velocities_[observation.image].known};
}

double CameraProblem::FlowSigma(std::size_t image) const {
  return std::sqrt(velocity_variance_) * velocities_[image].flow_sigma_px_per_s;
}

std::vector<CalibrationResidual> CameraProblem::Residuals(std::optional<std::size_t> camera) const {
  std::vector<CalibrationResidual> residuals;
  residuals.reserve(observations_.size());
  for (const Observation& observation : observations_) {
    if (observation.is_flow || (camera && camera_of(observation) != *camera)) continue;
    const auto parameters = ParametersOf(observation);
    Eigen::Vector2d found_less_observed;
    if (!CostOf(observation, 1).Evaluate(parameters.data(), found_less_observed.data(), nullptr))
      continue;
    residuals.push_back({observation.measured, -found_less_observed});
  }
  return residuals;
}

// A velocity comes from poses that others than this camera found, and from differences in time.
// What is known is how the image moves, to a share of that: with another camera it is another
// velocity. A turn and a shift that move the image nearly alike, as far away or straight above the
// ground, are known but together.
void CameraProblem::AddFlows(const SparseModel& map, const std::vector<std::size_t>& images,
                             std::size_t first_image) {
  constexpr std::size_t kMaxFlows = 24;  // of an image, for its six velocities
  std::vector<std::vector<Observation>> of_image(images.size());
  for (const Observation& observation : observations_) {
    if (observation.image < first_image) continue;
    of_image[observation.image - first_image].push_back(observation);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraModel& found_with = map.CameraOf(map.images[images[i]]);
    const ParameterVector camera = ToParameters(found_with);
    ImageVelocity& velocity = velocities_[first_image + i];
    const FlowCost flow_of(found_with.lens, Eigen::Vector2d::Zero(), 1, velocity.known);
    std::vector<Observation> flows;
    Information information = Information::Zero();
    double sum_of_squares = 0;
    const std::size_t stride = of_image[i].size() / kMaxFlows + 1;
    for (std::size_t k = 0; k < of_image[i].size(); k += stride) {
      Observation flow = of_image[i][k];
      flow.is_flow = true;
      auto parameters = ParametersOf(flow);
      parameters[0] = camera.data();
      Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_velocity;
      double* jacobians[] = {nullptr, nullptr, nullptr, by_velocity.data()};
      if (!flow_of.Evaluate(parameters.data(), flow.measured.data(), jacobians)) continue;
      information += by_velocity.transpose() * by_velocity;
      sum_of_squares += flow.measured.squaredNorm();
      flows.push_back(flow);
    }
    const double sigma_px_per_s = kVelocityShare * std::sqrt(sum_of_squares);
    if (!(sigma_px_per_s > 0) || Eigen::LLT<Information>(information).info() != Eigen::Success) {
      continue;
    }
    velocity.flow_sigma_px_per_s = sigma_px_per_s;
    observations_.insert(observations_.end(), flows.begin(), flows.end());
  }
  std::ranges::stable_sort(observations_, {}, [](const Observation& observation) {
    return std::pair(observation.point, observation.image);
  });
}

bool CameraProblem::HasFreeVelocity(std::size_t image) const {
  const FreeCamera& camera = cameras_[camera_of_image_[image]];
  const auto is_zero = [&](Parameter readout) {
    return camera.is_fixed[readout] && unknowns_.cameras[camera_of_image_[image]][readout] == 0;
  };
  return velocities_[image].flow_sigma_px_per_s > 0 &&
         !(is_zero(kReadoutByRows) && is_zero(kReadoutByColumns));
}

// Velocities by differences are off by more than is said where the camera shakes: by what the
// images say of them. Never less.
double CameraProblem::VelocityVariance() const {
  double sum = 0;
  for (const Observation& observation : observations_) {
    if (!observation.is_flow || !HasFreeVelocity(observation.image)) continue;
    const auto parameters = ParametersOf(observation);
    Eigen::Vector2d residual;
    const double sigma = velocities_[observation.image].flow_sigma_px_per_s;
    if (FlowCostOf(observation, sigma).Evaluate(parameters.data(), residual.data(), nullptr)) {
      sum += residual.squaredNorm();
    }
  }
  double count = 0;
  for (std::size_t i = 0; i < velocities_.size(); ++i) count += HasFreeVelocity(i) ? 6 : 0;
  return count > 0 ? std::max(1., sum / count) : 1;
}

void CameraProblem::Weigh() {
  // A coordinate cannot be measured better than this: interpolation of 8-bit images.
  constexpr double kMinSigma_px = 0.01;
  sigma_px_ =
      std::max(kMinSigma_px, kMadToSigma * UpperMedianOrZero(AbsoluteErrors_px(Residuals())));
  velocity_variance_ = VelocityVariance();
}

std::optional<Eigen::Vector2d> CameraProblem::Residual(const Observation& observation) const {
  if (observation.is_flow && !HasFreeVelocity(observation.image)) return Eigen::Vector2d(0, 0);
  const auto parameters = ParametersOf(observation);
  Eigen::Vector2d residual;
  const bool is_in_front =
      observation.is_flow
          ? FlowCostOf(observation, FlowSigma(observation.image))
                .Evaluate(parameters.data(), residual.data(), nullptr)
          : CostOf(observation, sigma_px_).Evaluate(parameters.data(), residual.data(), nullptr);
  return is_in_front ? std::optional(residual) : std::nullopt;
}

CameraProblem::CostSum CameraProblem::Cost() const {
  CostSum cost;
  const ceres::CauchyLoss loss(kLossScale);
  double rho[3];
  for (const Observation& observation : observations_) {
    const std::optional<Eigen::Vector2d> residual = Residual(observation);
    if (!residual) {
      ++cost.num_behind;
      continue;
    }
    if (observation.is_flow) {
      cost.sum += residual->squaredNorm() / 2;
      continue;
    }
    loss.Evaluate(residual->squaredNorm(), rho);
    cost.sum += rho[0] / 2;
  }
  const ceres::CauchyLoss loss_of_positions(kPositionLossScale);
  for (const MeasuredCentre& measured : positions_) {
    Eigen::Vector3d error;
    (void)measured.error(unknowns_.poses[measured.image].data(), error.data());
    loss_of_positions.Evaluate(error.squaredNorm(), rho);
    cost.sum += rho[0] / 2;
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const ParameterVector difference = parameters(i) - prior(i);
    cost.sum += difference.dot(prior_information(i).cwiseProduct(difference)) / 2;
  }
  return cost;
}

ParameterVector CameraProblem::prior_information(std::size_t camera) const {
  const FreeCamera& of = cameras_[camera];
  return of.is_fixed.select(0., of.prior_sigmas.array().square().inverse());
}

bool CameraProblem::HasVelocities() const {
  for (std::size_t i = 0; i < velocities_.size(); ++i) {
    if (HasFreeVelocity(i)) return true;
  }
  return false;
}

CameraProblem::Quadratic CameraProblem::KnownPosition(std::size_t image) const {
  Quadratic known;
  for (const MeasuredCentre& measured : positions_) {
    if (measured.image != image) continue;
    const double* parameters[] = {unknowns_.poses[image].data()};
    Eigen::Vector3d error;
    Eigen::Matrix<double, 3, 6, Eigen::RowMajor> J;
    double* jacobians[] = {J.data()};
    CentreCost(new tracking::CentreError(measured.error))
        .Evaluate(parameters, error.data(), jacobians);
    double rho[3];
    ceres::CauchyLoss(kPositionLossScale).Evaluate(error.squaredNorm(), rho);
    known.information += rho[1] * J.transpose() * J;
    known.gradient += rho[1] * J.transpose() * error;
  }
  return known;
}

Parameter CameraProblem::HoldLesserReadout(std::size_t camera) {
  const ParameterVector& found = parameters(camera);
  const bool is_by_rows = std::abs(found[kReadoutByRows]) >= std::abs(found[kReadoutByColumns]);
  const Parameter lesser = is_by_rows ? kReadoutByColumns : kReadoutByRows;
  ParameterFlags which = ParameterFlags::Constant(false);
  which[lesser] = !is_fixed(camera)[lesser];
  FixAtPrior(which, camera);
  return is_by_rows ? kReadoutByRows : kReadoutByColumns;
}

void CameraProblem::FixAtPrior(const ParameterFlags& which, std::size_t camera) {
  FreeCamera& held = cameras_[camera];
  held.is_fixed = held.is_fixed || which;
  unknowns_.cameras[camera] = which.select(held.prior, unknowns_.cameras[camera]);
}

void CameraProblem::Free(Parameter which, double prior_sigma, std::size_t camera) {
  cameras_[camera].prior_sigmas[which] = prior_sigma;
  cameras_[camera].is_fixed[which] = false;
}

CameraProblem::Linearised& CameraProblem::Linearised::operator*=(double factor) {
  residual *= factor;
  by_pose *= factor;
  by_velocity *= factor;
  by_camera *= factor;
  by_point *= factor;
  weight *= factor;
  return *this;
}

CameraProblem::Linearised CameraProblem::Linearise(const Observation& observation) const {
  Linearised result;
  const FreeCamera& camera = cameras_[camera_of(observation)];
  const auto parameters = ParametersOf(observation);
  double* jacobians[] = {result.by_camera.data(), result.by_pose.data(), result.by_point.data(),
                         result.by_velocity.data()};
  const auto evaluate = [&](const auto& cost) {
    return cost.Evaluate(parameters.data(), result.residual.data(), jacobians);
  };
  const bool has_free_velocity = HasFreeVelocity(observation.image);
  bool is_used = has_free_velocity || !observation.is_flow;
  if (is_used) {
    is_used = observation.is_flow ? evaluate(FlowCostOf(observation, FlowSigma(observation.image)))
                                  : evaluate(CostOf(observation, sigma_px_));
  }
  if (!is_used) {
    result = {};
    return result;
  }
  result.weight = 1;
  if (!observation.is_flow) {
    double rho[3];
    ceres::CauchyLoss(kLossScale).Evaluate(result.residual.squaredNorm(), rho);
    result *= std::sqrt(rho[1]);
  }
  if (!has_free_velocity) result.by_velocity.setZero();
  for (int i = 0; i < kNumParameters; ++i) {
    if (camera.is_fixed[i]) result.by_camera.col(i).setZero();
  }
  return result;
}

}  // namespace mono3d::calibration
