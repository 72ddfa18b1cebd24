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
using Vector6d = Eigen::Matrix<double, 6, 1>;

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
    velocities_.push_back({velocity});
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
  WeighVelocities(first_image);
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
      observations_, [&](const Observation& seen) { return camera_of(seen) == camera; }));
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
  return {cameras_[camera_of(observation)].shape, observation.pixel, sigma_px,
          velocities_[observation.image].known};
}

std::vector<CalibrationResidual> CameraProblem::Residuals(std::optional<std::size_t> camera) const {
  std::vector<CalibrationResidual> residuals;
  residuals.reserve(observations_.size());
  for (const Observation& observation : observations_) {
    if (camera && camera_of(observation) != *camera) continue;
    const auto parameters = ParametersOf(observation);
    Eigen::Vector2d found_less_observed;
    if (!CostOf(observation, 1).Evaluate(parameters.data(), found_less_observed.data(), nullptr))
      continue;
    residuals.push_back({observation.pixel, -found_less_observed});
  }
  return residuals;
}

// A velocity comes from poses that others than this camera found, and from differences in time: it
// is known by how the image moves, to a share of that. A turn and a shift that move the image
// nearly alike, as far away or straight above the ground, are known but together.
void CameraProblem::WeighVelocities(std::size_t first_image) {
  std::vector<Information> sums(unknowns_.poses.size() - first_image, Information::Zero());
  std::vector<double> squared_flows(sums.size(), 0);
  for (const Observation& observation : observations_) {
    if (observation.image < first_image) continue;
    const PoseBlock& pose = unknowns_.poses[observation.image];
    const Eigen::Vector3d turn(pose[0], pose[1], pose[2]);
    const double angle = turn.norm();
    const Eigen::Vector3d p_axes(unknowns_.points[observation.point].data());
    Eigen::Vector3d p_cam(pose[3], pose[4], pose[5]);
    p_cam += angle > 0 ? Eigen::AngleAxisd(angle, turn / angle) * p_axes : p_axes;
    const double distance = p_cam.norm();
    if (!(distance > 0)) continue;
    // How the ray to the point turns, per second.
    const Eigen::Vector3d ray = p_cam / distance;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    Eigen::Matrix<double, 3, 6> J;
    for (int i = 0; i < 3; ++i) J.col(i) = Eigen::Vector3d::Unit(i).cross(ray);
    J.rightCols<3>() = across / distance;
    const CameraVelocity& known = velocities_[observation.image].known;
    Eigen::Matrix<double, 6, 1> velocity;
    velocity << known.angular_rad_per_s, known.linear_su_per_s;
    sums[observation.image - first_image] += J.transpose() * J;
    squared_flows[observation.image - first_image] += (J * velocity).squaredNorm();
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double variance = kVelocityShare * kVelocityShare * squared_flows[i];
    if (!(variance > 0) || Eigen::LLT<Information>(sums[i]).info() != Eigen::Success) continue;
    velocities_[first_image + i].information = sums[i] / variance;
  }
}

bool CameraProblem::HasFreeVelocity(std::size_t image) const {
  const FreeCamera& camera = cameras_[camera_of_image_[image]];
  const auto is_zero = [&](Parameter readout) {
    return camera.is_fixed[readout] && unknowns_.cameras[camera_of_image_[image]][readout] == 0;
  };
  return !velocities_[image].information.isZero() &&
         !(is_zero(kReadoutByRows) && is_zero(kReadoutByColumns));
}

// Velocities that come from a wrong camera are off by more than is said: by what the images say of
// them. Never less.
double CameraProblem::VelocityVariance() const {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < velocities_.size(); ++i) {
    if (!HasFreeVelocity(i)) continue;
    const Eigen::Map<const Vector6d> change(unknowns_.velocity_changes[i].data());
    sum += change.dot(velocities_[i].information * change);
    count += 6;
  }
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
  const auto parameters = ParametersOf(observation);
  Eigen::Vector2d residual;
  const bool is_in_front =
      CostOf(observation, sigma_px_).Evaluate(parameters.data(), residual.data(), nullptr);
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
  for (std::size_t i = 0; i < velocities_.size(); ++i) {
    const Eigen::Map<const Vector6d> change(unknowns_.velocity_changes[i].data());
    cost.sum += change.dot(KnownVelocity(i).gradient) / 2;
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

CameraProblem::Quadratic CameraProblem::KnownVelocity(std::size_t image) const {
  Quadratic known;
  if (!HasFreeVelocity(image)) return known;
  known.information = velocities_[image].information / velocity_variance_;
  known.gradient =
      known.information * Eigen::Map<const Vector6d>(unknowns_.velocity_changes[image].data());
  return known;
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

CameraProblem::Linearised CameraProblem::Linearise(const Observation& observation) const {
  Linearised result;
  const FreeCamera& camera = cameras_[camera_of(observation)];
  const auto parameters = ParametersOf(observation);
  double* jacobians[] = {result.by_camera.data(), result.by_pose.data(), result.by_point.data(),
                         result.by_velocity.data()};
  if (!CostOf(observation, sigma_px_)
           .Evaluate(parameters.data(), result.residual.data(), jacobians)) {
    result.residual.setZero();
    result.by_camera.setZero();
    result.by_pose.setZero();
    result.by_point.setZero();
    result.by_velocity.setZero();
    return result;
  }
  double rho[3];
  ceres::CauchyLoss(kLossScale).Evaluate(result.residual.squaredNorm(), rho);
  const double weight = std::sqrt(rho[1]);
  result.residual *= weight;
  result.by_camera *= weight;
  result.by_pose *= weight;
  result.by_point *= weight;
  result.by_velocity *= HasFreeVelocity(observation.image) ? weight : 0;
  result.weight = weight;
  for (int i = 0; i < kNumParameters; ++i) {
    if (camera.is_fixed[i]) result.by_camera.col(i).setZero();
  }
  return result;
}

}  // namespace mono3d::calibration
