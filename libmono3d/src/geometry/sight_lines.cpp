// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/sight_lines.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "mono3d/geometry/triangulation.h"

namespace mono3d {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// In standard deviations; nothing behind the camera.
std::optional<double> SigmasOff(const SightLine& line, const Vector3d& p_world) {
  const std::optional<Vector2d> error = SightLineError(line, p_world);
  return error ? std::optional(error->norm() / line.sigma) : std::nullopt;
}

struct Agreement {
  std::vector<char> agrees;
  std::size_t count = 0;
  double sum = 0;  // of the squares of those that agree
};

Agreement AgreementOn(std::span<const SightLine> lines, const Vector3d& p_world, double gate) {
  Agreement agreement;
  for (const SightLine& line : lines) {
    const std::optional<double> sigmas = SigmasOff(line, p_world);
    const bool agrees = sigmas && *sigmas <= gate;
    agreement.agrees.push_back(agrees ? 1 : 0);
    if (!agrees) continue;
    ++agreement.count;
    agreement.sum += *sigmas * *sigmas;
  }
  return agreement;
}

bool IsBetter(const Agreement& a, const Agreement& b) {
  return a.count != b.count ? a.count > b.count : a.sum < b.sum;
}

// Gauss and Newton over the lines that agree. False where they do not hold the point.
bool RefineMeeting(std::span<const SightLine> lines, const std::vector<char>& agrees,
                   Vector3d& p_world, Matrix3d& covariance) {
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (agrees[i] == 0) continue;
      const Pose T_cam_world = lines[i].T_world_cam.Inverse();
      const Vector3d p_cam = T_cam_world * p_world;
      if (!(p_cam.z() > 0)) return false;
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1, 0, -p_cam.x() / p_cam.z(), 0, 1, -p_cam.y() / p_cam.z();
      by_point =
          by_point * T_cam_world.rotation().toRotationMatrix() / (p_cam.z() * lines[i].sigma);
      const Vector2d error =
          (lines[i].ray_cam.head<2>() - p_cam.head<2>() / p_cam.z()) / lines[i].sigma;
      information += by_point.transpose() * by_point;
      gradient += by_point.transpose() * error;
    }
    const Eigen::LDLT<Matrix3d> solver(information);
    const Vector3d step = solver.solve(gradient);
    if (!step.allFinite()) return false;
    p_world += step;
    covariance = solver.solve(Matrix3d::Identity());
    constexpr double kOfSigma = 1e-4;
    if (step.norm() <= kOfSigma * std::sqrt(std::max(0.0, covariance.trace()))) break;
  }
  return covariance.allFinite();
}

double LargestParallax(std::span<const SightLine> lines, const std::vector<char>& agrees,
                       const Vector3d& p_world) {
  double least_cosine = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t k = i + 1; k < lines.size(); ++k) {
      if (agrees[i] == 0 || agrees[k] == 0) continue;
      least_cosine = std::min(least_cosine, CosParallax(p_world, lines[i].T_world_cam.translation(),
                                                        lines[k].T_world_cam.translation()));
    }
  }
  return std::acos(std::clamp(least_cosine, -1.0, 1.0));
}

// The smallest angle that any two lines of sight make is that of lines from one place.
double LargestAngle(std::span<const SightLine> lines) {
  double least_cosine = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Vector3d a = (lines[i].T_world_cam.rotation() * lines[i].ray_cam).normalized();
    for (std::size_t k = i + 1; k < lines.size(); ++k) {
      const Vector3d b = (lines[k].T_world_cam.rotation() * lines[k].ray_cam).normalized();
      least_cosine = std::min(least_cosine, a.dot(b));
    }
  }
  return std::acos(std::clamp(least_cosine, -1.0, 1.0));
}

}  // namespace

std::optional<Vector2d> SightLineError(const SightLine& line, const Vector3d& p_world) {
  const Vector3d p_cam = line.T_world_cam.Inverse() * p_world;
  if (!(p_cam.z() > 0)) return std::nullopt;
  return Vector2d(p_cam.head<2>() / p_cam.z() - line.ray_cam.head<2>());
}

SightLineResult MeetSightLines(std::span<const SightLine> lines, double min_parallax_rad,
                               double gate) {
  if (lines.size() < 2) return {std::nullopt, SightLineProblem::kTooFew};
  if (LargestAngle(lines) < min_parallax_rad) return {std::nullopt, SightLineProblem::kNoParallax};
  constexpr std::size_t kMostTried = 12;  // lines that pairs are made of
  const std::size_t stride = (lines.size() + kMostTried - 1) / kMostTried;
  std::optional<Vector3d> best;
  Agreement best_agreement;
  for (std::size_t i = 0; i < lines.size(); i += stride) {
    for (std::size_t k = i + stride; k < lines.size(); k += stride) {
      const Pose& T_world_i = lines[i].T_world_cam;
      const auto p_i = Triangulate(lines[i].ray_cam, lines[k].ray_cam,
                                   lines[k].T_world_cam.Inverse() * T_world_i);
      if (!p_i) continue;
      const Vector3d p_world = T_world_i * *p_i;
      const Agreement agreement = AgreementOn(lines, p_world, gate);
      if (agreement.count < 2 || (best && !IsBetter(agreement, best_agreement))) continue;
      best = p_world;
      best_agreement = agreement;
    }
  }
  if (!best || 2 * best_agreement.count <= lines.size()) {
    return {std::nullopt, SightLineProblem::kContradiction};
  }
  SightLineMeeting meeting;
  meeting.p_world = *best;
  // The point moves with those that agree, and then more or fewer may.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (!RefineMeeting(lines, best_agreement.agrees, meeting.p_world, meeting.covariance)) {
      return {std::nullopt, SightLineProblem::kNoParallax};
    }
    Agreement next = AgreementOn(lines, meeting.p_world, gate);
    const bool is_settled = next.agrees == best_agreement.agrees;
    if (next.count < 2 || 2 * next.count <= lines.size()) {
      return {std::nullopt, SightLineProblem::kContradiction};
    }
    best_agreement = std::move(next);
    if (is_settled) break;
  }
  if (LargestParallax(lines, best_agreement.agrees, meeting.p_world) < min_parallax_rad) {
    return {std::nullopt, SightLineProblem::kNoParallax};
  }
  for (const char agrees : best_agreement.agrees) {
    meeting.is_outlier.push_back(agrees != 0 ? 0 : 1);
  }
  return {std::move(meeting), SightLineProblem::kNone};
}

}  // namespace mono3d
