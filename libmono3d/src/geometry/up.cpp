// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/up.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace mono3d {
namespace {

using Directions = std::vector<Eigen::Vector3d>;

constexpr double kDegree = std::numbers::pi / 180;

// What shows where up is, all unit vectors.
struct UpEvidence {
  Directions rights;    // of the cameras: level
  Directions steps;     // between cameras that follow each other: mostly level
  Directions forwards;  // of the cameras
  Directions downs;     // y of their images
  Directions normals;   // of the surface
};

// Every so many of `size`, so that about `most` are taken.
std::size_t StrideFor(std::size_t size, std::size_t most) {
  return std::max<std::size_t>(1, size / most);
}

UpEvidence EvidenceOf(std::span<const Pose> T_world_cam, std::span<const Eigen::Vector3f> normals,
                      const ImageDirections& shown) {
  constexpr std::size_t kMostCameras = 300;
  constexpr std::size_t kMostNormals = 1500;
  UpEvidence evidence;
  std::optional<Eigen::Vector3d> last;
  const std::size_t stride = StrideFor(T_world_cam.size(), kMostCameras);
  for (std::size_t i = 0; i < T_world_cam.size(); i += stride) {
    const Pose& camera = T_world_cam[i];
    evidence.rights.push_back(camera.rotation() * shown.right);
    evidence.downs.push_back(camera.rotation() * shown.down);
    evidence.forwards.push_back(camera.rotation() * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d& centre = camera.translation();
    if (last && (centre - *last).norm() > 0) {
      evidence.steps.push_back((centre - *last).normalized());
    }
    last = centre;
  }
  for (std::size_t i = 0; i < normals.size(); i += StrideFor(normals.size(), kMostNormals)) {
    evidence.normals.push_back(normals[i].cast<double>());
  }
  return evidence;
}

// Mean over the directions of how far they are from the plane across `up`: 0 within it, towards 1
// beyond `tolerance_rad`, whatever the distance (Geman and McClure).
double Tilt(const Directions& directions, const Eigen::Vector3d& up, double tolerance_rad) {
  if (directions.empty()) return 0;
  double sum = 0;
  for (const Eigen::Vector3d& direction : directions) {
    const double squared = std::pow(direction.dot(up) / std::sin(tolerance_rad), 2);
    sum += squared / (1 + squared);
  }
  return sum / static_cast<double>(directions.size());
}

// The share of the directions that are `up`.
double Support(const Directions& directions, const Eigen::Vector3d& up, double tolerance_rad) {
  if (directions.empty()) return 0;
  const double squared_tolerance = tolerance_rad * tolerance_rad;
  double sum = 0;
  for (const Eigen::Vector3d& direction : directions) {
    const double squared_rad = 2 * (1 - std::min(1.0, direction.dot(up)));
    if (squared_rad > 16 * squared_tolerance) continue;  // less than 0.0004
    sum += std::exp(-squared_rad / (2 * squared_tolerance));
  }
  return sum / static_cast<double>(directions.size());
}

double MeanDot(const Directions& directions, const Eigen::Vector3d& up) {
  double sum = 0;
  for (const Eigen::Vector3d& direction : directions) sum += direction.dot(up);
  return sum / static_cast<double>(directions.size());
}

// As Tilt, of steps: a climb straight up or down costs half of what a slanted one does.
double SlantOfSteps(const Directions& steps, const Eigen::Vector3d& up, double tolerance_rad) {
  constexpr double kCostOfClimb = 0.5;
  if (steps.empty()) return 0;
  const double tolerance = std::pow(std::sin(tolerance_rad), 2);
  double sum = 0;
  for (const Eigen::Vector3d& step : steps) {
    const double upwards = std::pow(step.dot(up), 2);
    const double from_level = upwards / (upwards + tolerance);
    const double from_vertical = (1 - upwards) / (1 - upwards + tolerance);
    sum += from_level * (kCostOfClimb + (1 - kCostOfClimb) * from_vertical);
  }
  return sum / static_cast<double>(steps.size());
}

// Roofs and slopes about the horizontal.
constexpr double kSlope = 10 * kDegree;

double SupportOfSurface(const UpEvidence& evidence, const Eigen::Vector3d& up) {
  return Support(evidence.normals, up, kSlope);
}

// The smaller, the better. `most_support`: of the surface, in any direction that is possible.
double Cost(const UpEvidence& evidence, const Eigen::Vector3d& up, double support,
            double most_support) {
  // Roll of a gimbal or a steady hand; a climb.
  constexpr double kRoll = 4 * kDegree;
  constexpr double kClimb = 10 * kDegree;
  // A flight may climb all along, and a wall may fill all images: both count less than the cameras.
  constexpr double kStepWeight = 0.3;
  constexpr double kSurfaceWeight = 0.6;
  // Normals that point anywhere in a half sphere, as those of leaves, give each direction kSlope
  // squared, .03: what no direction has clearly more of says little.
  constexpr double kSupportOfLeaves = 0.1;
  return Tilt(evidence.rights, up, kRoll) + kStepWeight * SlantOfSteps(evidence.steps, up, kClimb) -
         kSurfaceWeight * support / (most_support + kSupportOfLeaves);
}

// No camera is upside down in the mean, and none looks up steeply.
bool IsPossible(const UpEvidence& evidence, const Eigen::Vector3d& up) {
  constexpr double kMostUpsideDown = 10 * kDegree;  // beyond looking straight down
  constexpr double kSteepest = 40 * kDegree;
  return MeanDot(evidence.downs, up) < std::sin(kMostUpsideDown) &&
         MeanDot(evidence.forwards, up) < std::sin(kSteepest);
}

// Evenly over the sphere, about 2.5 degrees apart: on a spiral whose turns are equally far apart as
// its points.
Directions AllDirections() {
  constexpr int kNum = 6000;
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  Directions directions;
  for (int i = 0; i < kNum; ++i) {
    const double z = 1 - (2 * i + 1.0) / kNum;
    const double radius = std::sqrt(1 - z * z);
    directions.emplace_back(radius * std::cos(golden_angle * i),
                            radius * std::sin(golden_angle * i), z);
  }
  return directions;
}

// Downhill in ever smaller steps around the axes across `up`.
Eigen::Vector3d Refined(const UpEvidence& evidence, double most_support, Eigen::Vector3d up) {
  constexpr double kFirstStep = 1.5 * kDegree;
  constexpr double kLastStep = 0.02 * kDegree;
  const auto cost_of = [&](const Eigen::Vector3d& direction) {
    return Cost(evidence, direction, SupportOfSurface(evidence, direction), most_support);
  };
  double cost = cost_of(up);
  for (double step = kFirstStep; step > kLastStep;) {
    const Eigen::Vector3d across = up.unitOrthogonal();
    bool is_better = false;
    for (const Eigen::Vector3d& axis : {across, Eigen::Vector3d(up.cross(across))}) {
      for (const double angle : {-step, step}) {
        const Eigen::Vector3d candidate = Eigen::AngleAxisd(angle, axis) * up;
        const double candidate_cost = cost_of(candidate);
        if (candidate_cost >= cost || !IsPossible(evidence, candidate)) continue;
        up = candidate.normalized();
        cost = candidate_cost;
        is_better = true;
      }
    }
    if (!is_better) step /= 2;
  }
  return up;
}

std::optional<Eigen::Vector3d> MostLikelyUp(const UpEvidence& evidence) {
  struct Candidate {
    Eigen::Vector3d up;
    double support = 0;
  };
  std::vector<Candidate> candidates;
  double most_support = 0;
  for (const Eigen::Vector3d& up : AllDirections()) {
    if (!IsPossible(evidence, up)) continue;
    candidates.push_back({up, SupportOfSurface(evidence, up)});
    most_support = std::max(most_support, candidates.back().support);
  }
  if (candidates.empty()) return std::nullopt;
  const auto best = std::ranges::min_element(candidates, {}, [&](const Candidate& candidate) {
    return Cost(evidence, candidate.up, candidate.support, most_support);
  });
  return Refined(evidence, most_support, best->up);
}

}  // namespace

ImageDirections ImageDirections::Shown(int turn_deg) {
  const double turn = turn_deg * kDegree;
  return {{std::cos(turn), -std::sin(turn), 0}, {std::sin(turn), std::cos(turn), 0}};
}

std::optional<Eigen::Vector3d> FindUp(std::span<const Pose> T_world_cam,
                                      std::span<const Eigen::Vector3f> normals, int turn_deg) {
  constexpr std::size_t kFewestCameras = 3;
  if (T_world_cam.size() < kFewestCameras) return std::nullopt;
  return MostLikelyUp(EvidenceOf(T_world_cam, normals, ImageDirections::Shown(turn_deg)));
}

}  // namespace mono3d
