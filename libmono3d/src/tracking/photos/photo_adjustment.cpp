// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_adjustment.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "tracking/optimisation/centre_error.h"
#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Rotation vector and translation of T_cam_metric; the origin is in the middle of the cameras.
using CameraBlock = std::array<double, 6>;
using PointBlock = std::array<double, 3>;

// A point through a pinhole, at z = 1, minus where it is seen.
struct RayError {
  Vector2d ray;
  Vector2d weight;

  template <typename T>
  bool operator()(const T* const camera, const T* const point, T* error) const {
    std::array<T, 3> p;
    ceres::AngleAxisRotatePoint(camera, point, p.data());
    for (std::size_t i = 0; i < 3; ++i) p.at(i) += camera[3 + i];
    error[0] = (p[0] / p[2] - ray.x()) * weight.x();
    error[1] = (p[1] / p[2] - ray.y()) * weight.y();
    return true;
  }
};

struct PlaceError {
  Vector3d p_m;
  Vector3d weight;  // 0: not known

  template <typename T>
  bool operator()(const T* const point, T* error) const {
    for (int i = 0; i < 3; ++i) error[i] = (point[i] - p_m[i]) * weight[i];
    return true;
  }
};

CameraBlock BlockOf(const Pose& T_cam_metric) {
  const Vector3d omega = RotationLog(T_cam_metric.rotation());
  const Vector3d& t = T_cam_metric.translation();
  return {omega.x(), omega.y(), omega.z(), t.x(), t.y(), t.z()};
}

Pose PoseOfBlock(const CameraBlock& block) {
  return {RotationExp({block[0], block[1], block[2]}), Vector3d(block[3], block[4], block[5])};
}

// By the distances of all observations, which are of two errors each.
double SigmaOfObservations_px(const SparseModel& model) {
  std::vector<double> errors_px;
  for (const SparseImage& image : model.images) {
    const Pose T_cam_world = image.T_world_cam.Inverse();
    for (const SparseObservation& seen : image.observations) {
      if (!seen.point) continue;
      const Vector3d p_cam = T_cam_world * model.points[*seen.point].p_world;
      if (p_cam.z() > 0) errors_px.push_back((model.camera.Project(p_cam) - seen.pixel).norm());
    }
  }
  const double median_over_sigma = std::sqrt(2 * std::numbers::ln2);  // of Rayleigh's distribution
  constexpr double kLeast_px = 0.05;  // no feature is better, and 0 has no weight
  return std::max(kLeast_px, UpperMedianOrZero(std::move(errors_px)) / median_over_sigma);
}

class EarthAdjustment {
 public:
  EarthAdjustment(SparseModel& model, const CameraPositions& positions)
      : model_(model), positions_(positions), problem_(Ownership()) {
    Vector3d sum = Vector3d::Zero();
    for (const SparseImage& image : model.images) {
      sum += positions.S_metric_map * image.T_world_cam.translation();
    }
    middle_m_ = sum / static_cast<double>(model.images.size());
    S_middle_map_ =
        Similarity(1, Pose(Eigen::Quaterniond::Identity(), -middle_m_)) * positions.S_metric_map;
    AddImages();
    AddPositions();
    AddKnownPoints();
  }

  bool IsWorthwhile() const {
    constexpr std::size_t kFewest = 3;
    return centres_.size() + places_.size() >= kFewest;
  }

  bool Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    // Ceres refuses an order of blocks that no residual has, as those of points that no image
    // shows.
    const auto add = [&](double* block, int group) {
      if (!problem_.HasParameterBlock(block)) return;
      options.linear_solver_ordering->AddElementToGroup(block, group);
    };
    for (PointBlock& point : points_) add(point.data(), 0);
    // A group for each vector: Ceres orders those of one group by address.
    for (PointBlock& place : place_blocks_) add(place.data(), 1);
    for (CameraBlock& camera : cameras_) add(camera.data(), 2);
    options.max_num_iterations = 50;
    options.function_tolerance = 1e-6;
    options.num_threads = 1;  // sums in one order: same input, same bytes out
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  // Takes the poses and points over; returns S_metric_map.
  Similarity MoveMap() {
    const Pose& T_map_first = model_.images.front().T_world_cam;
    const Similarity S_map_cam(1 / positions_.S_metric_map.scale(), T_map_first);
    const Similarity S_map_middle = S_map_cam * Similarity(1, PoseOfBlock(cameras_.front()));
    for (std::size_t i = 0; i < model_.images.size(); ++i) {
      model_.images[i].T_world_cam = S_map_middle * PoseOfBlock(cameras_[i]).Inverse();
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      model_.points[i].p_world = S_map_middle * Vector3d(points_[i].data());
    }
    return Similarity(1, Pose(Eigen::Quaterniond::Identity(), middle_m_)) * S_map_middle.Inverse();
  }

  void CountUsed(PositionFit& fit) const {
    const auto count = [](const Vector3d& error, std::size_t& used, std::size_t& outliers) {
      ++(error.squaredNorm() <= kChi2ThreeDofSure ? used : outliers);
    };
    for (const auto& [image, error] : centres_) {
      Vector3d off;
      error(cameras_[image].data(), off.data());
      count(off, fit.num_used, fit.num_outliers);
    }
    for (const auto& [place, error] : places_) {
      Vector3d off;
      error(place_blocks_[place].data(), off.data());
      count(off, fit.num_points_used, fit.num_point_outliers);
    }
  }

 private:
  static ceres::Problem::Options Ownership() {
    ceres::Problem::Options ownership;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return ownership;
  }

  void AddRay(const Vector2d& ray, const Vector2d& weight, CameraBlock& camera, PointBlock& point) {
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RayError, 2, 6, 3>(new RayError{ray, weight}), &of_pixels_,
        camera.data(), point.data());
  }

  void AddImages() {
    const CameraModel& camera = model_.camera;
    const double sigma_px = SigmaOfObservations_px(model_);
    const Vector2d weight = Vector2d(camera.fx, camera.fy) / sigma_px;
    for (const SparsePoint& point : model_.points) {
      const Vector3d p = S_middle_map_ * point.p_world;
      points_.push_back({p.x(), p.y(), p.z()});
    }
    for (const SparseImage& image : model_.images) {
      image_of_[image.id] = cameras_.size();
      cameras_.push_back(BlockOf((S_middle_map_ * image.T_world_cam).Inverse()));
    }
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      for (const SparseObservation& seen : model_.images[i].observations) {
        if (!seen.point) continue;
        AddRay(camera.Unproject(seen.pixel).head<2>(), weight, cameras_[i], points_[*seen.point]);
      }
    }
  }

  void AddPositions() {
    for (const CameraPosition& position : positions_.positions) {
      const auto found = image_of_.find(position.frame_index);
      if (found == image_of_.end()) continue;
      Vector3d weight = WeightOf(position.sigma_m);
      if (!positions_.has_vertical) weight.z() = 0;
      const CentreError error{position.p_m - middle_m_, weight};
      centres_.emplace_back(found->second, error);
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<CentreError, 3, 6>(new CentreError(error)),
          &of_positions_, cameras_[found->second].data());
    }
  }

  void AddKnownPoints() {
    place_blocks_.reserve(positions_.points.size());  // they stay where they are
    for (const KnownPoint& known : positions_.points) {
      std::vector<std::pair<std::size_t, const PointSight*>> sights;
      for (const PointSight& sight : known.sights) {
        const auto found = image_of_.find(sight.frame_index);
        if (found != image_of_.end()) sights.emplace_back(found->second, &sight);
      }
      constexpr std::size_t kFewestSights = 2;
      if (sights.size() < kFewestSights) continue;
      const PlaceError error{known.p_m - middle_m_, WeightOf(known.sigma_m)};
      PointBlock& block =
          place_blocks_.emplace_back(PointBlock{error.p_m.x(), error.p_m.y(), error.p_m.z()});
      places_.emplace_back(place_blocks_.size() - 1, error);
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PlaceError, 3, 3>(new PlaceError(error)), &of_points_,
          block.data());
      for (const auto& [image, sight] : sights) {
        AddRay(sight->ray_cam.head<2>(), Vector2d::Constant(1 / sight->sigma), cameras_[image],
               block);
      }
    }
  }

  SparseModel& model_;
  const CameraPositions& positions_;
  Vector3d middle_m_ = Vector3d::Zero();
  Similarity S_middle_map_;
  std::map<std::int64_t, std::size_t> image_of_;  // of each id
  std::vector<CameraBlock> cameras_;
  std::vector<PointBlock> points_;
  std::vector<PointBlock> place_blocks_;                      // of known points
  std::vector<std::pair<std::size_t, CentreError>> centres_;  // with their image
  std::vector<std::pair<std::size_t, PlaceError>> places_;    // with their block
  ceres::HuberLoss of_pixels_{std::sqrt(kChi2TwoDof)};
  ceres::CauchyLoss of_positions_{std::sqrt(kChi2ThreeDof)};
  ceres::HuberLoss of_points_{std::sqrt(kChi2ThreeDof)};
  ceres::Problem problem_;  // ends first
};

}  // namespace

std::optional<PositionFit> AdjustToEarth(SparseModel& model, CameraPositions& positions) {
  if (model.images.empty() || model.points.empty()) return std::nullopt;
  std::vector<Vector3d> before, after;
  for (const SparseImage& image : model.images) before.push_back(image.T_world_cam.translation());
  EarthAdjustment adjustment(model, positions);
  if (!adjustment.IsWorthwhile() || !adjustment.Solve()) return std::nullopt;
  PositionFit fit;
  fit.map_id = positions.map_id;
  adjustment.CountUsed(fit);
  const Similarity S_metric_map = adjustment.MoveMap();
  for (const SparseImage& image : model.images) after.push_back(image.T_world_cam.translation());
  if (after.size() >= 3) {
    const Similarity moved = FitSimilarity(before, after);
    double sum = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      sum += (moved * before[i] - after[i]).squaredNorm();
    }
    fit.rms_moved_m = S_metric_map.scale() * std::sqrt(sum / static_cast<double>(after.size()));
  }
  positions.S_metric_map = S_metric_map;
  return fit;
}

}  // namespace mono3d::tracking
