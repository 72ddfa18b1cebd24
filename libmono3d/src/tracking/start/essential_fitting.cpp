// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/essential_fitting.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "tracking/start/model_comparison.h"

namespace mono3d::tracking {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

// Rays of a pair, at z = 1.
struct Rays {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
};

// A motion by its rotation and the direction of its translation.
struct Motion {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d direction;

  // A rotation about each axis, and the direction along two vectors across it; radians.
  Motion Moved(const Vector5& step) const {
    const Eigen::Vector3d across = direction.unitOrthogonal();
    const Eigen::Vector3d other = direction.cross(across);
    return {RotationExp(step.head<3>()) * rotation,
            (direction + step[3] * across + step[4] * other).normalized()};
  }

  Eigen::Matrix3d Essential() const {
    Eigen::Matrix3d cross;
    cross << 0, -direction.z(), direction.y(), direction.z(), 0, -direction.x(), -direction.y(),
        direction.x(), 0;
    return cross * rotation.toRotationMatrix();
  }
};

// Of each pair, in standard deviations.
Eigen::VectorXd SampsonDistances(const Motion& motion, const std::vector<Rays>& rays,
                                 double sigma) {
  constexpr double kNotZero = 1e-30;  // both rays along the translation
  const Eigen::Matrix3d E = motion.Essential();
  const Eigen::Matrix3d E_transposed = E.transpose();
  Eigen::VectorXd distances(static_cast<Eigen::Index>(rays.size()));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d line_b = E * rays[i].a;
    const Eigen::Vector3d line_a = E_transposed * rays[i].b;
    const double gradient =
        line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm() + kNotZero;
    distances[static_cast<Eigen::Index>(i)] = rays[i].b.dot(line_b) / (sigma * std::sqrt(gradient));
  }
  return distances;
}

// Cauchy's loss has 95 % of the efficiency of least squares with this scale (Holland, Welsch 1977).
constexpr double kCauchyScale = 2.385;

Eigen::ArrayXd Losses(const Eigen::VectorXd& distances) {
  return (distances.array() / kCauchyScale).square().log1p();
}

// The least loss that is reached from `motion` downhill (Levenberg-Marquardt).
Motion Descend(Motion motion, const std::vector<Rays>& rays, double sigma) {
  constexpr int kMaxSteps = 30;
  constexpr double kMinGain = 1e-4;  // of the loss: a step of .02 standard deviations
  constexpr double kDelta = 1e-6;    // rad, of the derivatives
  constexpr double kMaxDamping = 1e4;
  Eigen::VectorXd distances = SampsonDistances(motion, rays, sigma);
  double loss = Losses(distances).sum();
  double damping = 1e-3;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix<double, Eigen::Dynamic, 5> J(distances.size(), 5);
    for (Eigen::Index k = 0; k < 5; ++k) {
      const Motion moved = motion.Moved(kDelta * Vector5::Unit(k));
      J.col(k) = (SampsonDistances(moved, rays, sigma) - distances) / kDelta;
    }
    const Eigen::VectorXd weights =
        (1 + (distances.array() / kCauchyScale).square()).inverse().matrix();
    const Matrix5 H = J.transpose() * weights.asDiagonal() * J;
    const Vector5 gradient = J.transpose() * weights.cwiseProduct(distances);
    double gain = 0;
    while (!(gain > 0) && damping < kMaxDamping) {
      Matrix5 damped = H;
      damped.diagonal() *= 1 + damping;
      const Motion moved = motion.Moved(-damped.ldlt().solve(gradient));
      const Eigen::VectorXd at_moved = SampsonDistances(moved, rays, sigma);
      gain = loss - Losses(at_moved).sum();
      if (gain > 0) {
        motion = moved;
        distances = at_moved;
        loss -= gain;
        damping *= 0.2;
      } else {
        damping *= 5;
      }
    }
    if (!(gain > kMinGain)) break;
  }
  return motion;
}

// The rotation that brings the rays of `a` nearest to those of `b`, as if all were far away.
Eigen::Quaterniond NearestRotation(const std::vector<Rays>& rays) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Rays& pair : rays) sum += pair.b.normalized() * pair.a.normalized().transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  if (U.determinant() * svd.matrixV().determinant() < 0) U.col(2) *= -1;
  return Eigen::Quaterniond(Eigen::Matrix3d(U * svd.matrixV().transpose()));
}

// The 13 axes through the middles of a cube's faces, its edges' and its corners: none is farther
// than 28 degrees from any direction. A direction and its opposite have the same epipolar lines.
std::vector<Eigen::Vector3d> DirectionsAllAround() {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 14; i < 27; ++i) {
    directions.push_back(Eigen::Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1).normalized());
  }
  return directions;
}

double SigmaOfRays(double sigma_px, const CameraModel& camera) {
  return sigma_px / std::sqrt(camera.fx * camera.fy);
}

std::vector<Rays> RaysOf(std::span<const PointPair> pairs, const CameraModel& camera) {
  std::vector<Rays> rays;
  rays.reserve(pairs.size());
  for (const PointPair& pair : pairs) {
    rays.push_back({camera.Unproject(pair.a), camera.Unproject(pair.b)});
  }
  return rays;
}

// Those of which there are no more than needed to find the way; the last steps take all.
std::vector<Rays> Some(const std::vector<Rays>& rays) {
  constexpr std::size_t kEnough = 150;  // 30 for each unknown
  const std::size_t stride = std::max<std::size_t>(1, rays.size() / kEnough);
  std::vector<Rays> some;
  for (std::size_t i = 0; i < rays.size(); i += stride) some.push_back(rays[i]);
  return some;
}

bool IsSameMatrix(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  constexpr double kMinCosine = 0.9999;  // a direction that differs by less than a degree
  return std::abs(a.cwiseProduct(b).sum()) > kMinCosine;
}

}  // namespace

std::vector<EpipolarFit> FitEssentials(std::span<const Pose> guesses,
                                       std::span<const PointPair> pairs, const CameraModel& camera,
                                       double sigma_px) {
  if (pairs.size() < 8) return {};
  const double sigma = SigmaOfRays(sigma_px, camera);
  const std::vector<Rays> rays = RaysOf(pairs, camera);
  const std::vector<Rays> some = Some(rays);
  std::vector<Motion> starts;
  for (const Pose& guess : guesses) {
    if (guess.translation().norm() <= 0) continue;
    starts.push_back({guess.rotation(), guess.translation().normalized()});
  }
  const Eigen::Quaterniond rotation = NearestRotation(rays);
  for (const Eigen::Vector3d& direction : DirectionsAllAround()) {
    starts.push_back({rotation, direction});
  }
  std::vector<Eigen::Matrix3d> roughly;
  std::vector<EpipolarFit> fits;
  const auto is_among = [](const Eigen::Matrix3d& matrix, const auto& others, const auto& of) {
    return std::ranges::any_of(
        others, [&](const auto& other) { return IsSameMatrix(matrix, std::invoke(of, other)); });
  };
  for (const Motion& start : starts) {
    const Motion found = Descend(start, some, sigma);
    const Eigen::Matrix3d rough = found.Essential().normalized();
    if (is_among(rough, roughly, std::identity{})) continue;
    roughly.push_back(rough);
    const Motion fine = Descend(found, rays, sigma);
    const Eigen::Matrix3d essential = fine.Essential().normalized();
    if (is_among(essential, fits, &EpipolarFit::essential)) continue;
    const Eigen::ArrayXd losses = Losses(SampsonDistances(fine, rays, sigma));
    fits.push_back({essential, {losses.begin(), losses.end()}});
  }
  std::ranges::stable_sort(fits, {}, [](const EpipolarFit& fit) { return Sum(fit.losses); });
  std::erase_if(fits, [best = fits.front()](const EpipolarFit& fit) {
    return IsClearlyBetter(best.losses, fit.losses);
  });
  return fits;
}

std::vector<double> EpipolarLosses(const Pose& T_b_a, std::span<const PointPair> pairs,
                                   const CameraModel& camera, double sigma_px) {
  const Motion motion{T_b_a.rotation(), T_b_a.translation().normalized()};
  const Eigen::ArrayXd losses =
      Losses(SampsonDistances(motion, RaysOf(pairs, camera), SigmaOfRays(sigma_px, camera)));
  return {losses.begin(), losses.end()};
}

}  // namespace mono3d::tracking
