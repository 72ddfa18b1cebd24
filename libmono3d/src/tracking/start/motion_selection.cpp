// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/motion_selection.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracking/map/map.h"
#include "tracking/motion_model.h"
#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_optimisation.h"
#include "tracking/start/match_alignment.h"
#include "tracking/start/model_comparison.h"

namespace mono3d::tracking {
namespace {

constexpr std::size_t kMinPlaces = 30;  // of the points in a view: as many as a pose rests on
// px of the octave of alignment: noise of the image and of the bilinear interpolation.
constexpr double kAlignedSigma = 0.3;
constexpr double kTakenSigma = 0.1;  // px: next to nothing, yet not a division by it

// A place of the first view in one of the others.
struct Place {
  std::size_t feature_a = 0;
  Eigen::Vector2d pixel;
  double sigma_px = 1;
};

// A view besides the first, and where it shows the features of that.
struct SupportView {
  double progress = 0;  // 0 at the first view, 1 at the second
  std::vector<Place> places;
};

// Where the other view shows the patches of the matches' features, to a fraction of a pixel: the
// two motions over a plane differ by less than corners are sure of. Without images, the corners.
std::vector<Place> Locate(const View& a, const View& other,
                          const std::vector<FeatureMatch>& matches) {
  std::vector<Place> places;
  for (const FeatureMatch& match : matches) {
    const Feature& in_other = other.features[match.feature_b];
    if (a.octaves.empty() || other.octaves.empty()) {
      places.push_back(
          {match.feature_a, other.image_motion.AtMiddleLine(in_other.pixel), in_other.sigma_px});
    } else if (const std::optional<PatchPosition> found = AlignMatch(a, other, match)) {
      places.push_back({match.feature_a, other.image_motion.AtMiddleLine(found->pixel),
                        kAlignedSigma * std::ldexp(1.0, found->octave)});
    }
  }
  return places;
}

// A feature of the first view, and its point in space under each of the candidates.
struct CommonPoint {
  std::size_t feature_a = 0;
  std::vector<Eigen::Vector3d> p_a;
};

// Those that all candidates have a point for: on others their errors could not be compared.
std::vector<CommonPoint> CommonPoints(const std::vector<TwoViewStart>& candidates,
                                      std::size_t num_features) {
  std::vector<CommonPoint> of_feature(num_features);
  for (const TwoViewStart& candidate : candidates) {
    for (std::size_t i = 0; i < candidate.matches.size(); ++i) {
      of_feature[candidate.matches[i].feature_a].p_a.push_back(candidate.p_a[i]);
    }
  }
  std::vector<CommonPoint> common;
  for (std::size_t feature = 0; feature < num_features; ++feature) {
    if (of_feature[feature].p_a.size() != candidates.size()) continue;
    common.push_back({feature, std::move(of_feature[feature].p_a)});
  }
  return common;
}

// The plane w with w * x = 1 / z for what a camera sees at x = (X / Z, Y / Z, 1): the one nearest
// to the points, by least squares.
Eigen::Vector3d InverseDepthPlane(const std::vector<Eigen::Vector3d>& p_a) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : p_a) {
    const Eigen::Vector3d x = p / p.z();
    A += x * x.transpose();
    b += x / p.z();
  }
  return A.ldlt().solve(b);
}

// Of two views that share half of their image a third one shows but a strip, and nearly every plane
// fits a strip. What only the first view and one from before it show tells more: the motion between
// these two. Those features, at the depth of each candidate's plane.
void AddPointsSeenBefore(const std::vector<TwoViewStart>& candidates, const View& a,
                         const std::vector<SupportView>& supports, const CameraModel& camera,
                         std::vector<CommonPoint>& points) {
  // Beyond the horizon of a plane there is no depth: far away.
  constexpr double kMinShare = 0.1;  // of the inverse depth of the farthest point
  std::vector<char> is_known(a.features.size(), 0);
  std::vector<Eigen::Vector3d> planes;
  std::vector<double> min_inverse_depths;
  for (const TwoViewStart& candidate : candidates) {
    for (const FeatureMatch& match : candidate.matches) is_known[match.feature_a] = 1;
    planes.push_back(InverseDepthPlane(candidate.p_a));
    double max_depth = 0;
    for (const Eigen::Vector3d& p : candidate.p_a) max_depth = std::max(max_depth, p.z());
    min_inverse_depths.push_back(kMinShare / max_depth);
  }
  for (const SupportView& support : supports) {
    if (support.progress >= 0) continue;
    for (const Place& place : support.places) {
      if (is_known[place.feature_a] != 0) continue;
      is_known[place.feature_a] = 1;
      const Eigen::Vector3d x =
          camera.Unproject(a.image_motion.AtMiddleLine(a.features[place.feature_a].pixel));
      CommonPoint& point = points.emplace_back(CommonPoint{place.feature_a, {}});
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        point.p_a.emplace_back(x / std::max(planes[i].dot(x), min_inverse_depths[i]));
      }
    }
  }
}

// The views and points of one candidate, each view at the pose that suits the points best.
BundleAdjustmentProblem BuildProblem(const std::vector<CommonPoint>& points, std::size_t candidate,
                                     const Pose& T_b_a, const View& a,
                                     const std::vector<SupportView>& supports,
                                     const CameraModel& camera) {
  BundleAdjustmentProblem problem;
  problem.camera = camera;
  problem.T_cam_world = {Pose()};
  problem.is_fixed = {1};
  std::vector<std::optional<std::size_t>> point_of_feature(a.features.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    problem.p_world.push_back(points[i].p_a[candidate]);
    point_of_feature[points[i].feature_a] = i;
    const Feature& in_a = a.features[points[i].feature_a];
    // Patches are taken at this very place: what is unsure is where the others show them.
    const double sigma_px = a.octaves.empty() ? in_a.sigma_px : kTakenSigma;
    problem.observations.push_back({0, i, a.image_motion.AtMiddleLine(in_a.pixel), sigma_px});
  }
  for (const SupportView& support : supports) {
    const std::size_t view = problem.T_cam_world.size();
    std::vector<PointMeasurement> measurements;
    for (const Place& place : support.places) {
      const std::optional<std::size_t> point = point_of_feature[place.feature_a];
      if (!point) continue;
      measurements.push_back({problem.p_world[*point], place.pixel, place.sigma_px});
      problem.observations.push_back({view, *point, place.pixel, place.sigma_px});
    }
    const Pose guess = ScaleMotion(T_b_a, support.progress);
    problem.T_cam_world.push_back(OptimisePose(camera, guess, measurements).T_cam_world);
    problem.is_fixed.push_back(0);
  }
  return problem;
}

// A candidate after the adjustment over all views.
struct Adjusted {
  TwoViewStart start;
  std::vector<double> costs;  // what is left of the error of each point over all views
  std::size_t num_observations = 0;
};

// An outlier counts as if at the limit, under either motion.
Adjusted Adjust(BundleAdjustmentProblem problem, const std::vector<CommonPoint>& points,
                const TwoViewStart& candidate) {
  // All of them robust. A plane seen under little parallax converges slowly: of a climb over fields
  // the right motion had 1.8 times the error of the wrong one after 40 steps, and the same at its
  // end, for which 100 were enough.
  constexpr int kSteps = 200;
  constexpr double kMinGain = 1e-7;
  SolveBundleAdjustment(problem, {kSteps, 0, kMinGain});
  Adjusted adjusted;
  adjusted.costs.assign(points.size(), 0);
  adjusted.num_observations = problem.observations.size();
  for (const BundleAdjustmentObservation& observation : problem.observations) {
    const Eigen::Vector3d p_cam =
        problem.T_cam_world[observation.view] * problem.p_world[observation.point];
    const double chi2 = (problem.camera.Project(p_cam) - observation.pixel).squaredNorm() /
                        (observation.sigma_px * observation.sigma_px);
    adjusted.costs[observation.point] += p_cam.z() > 0 ? std::min(chi2, kChi2TwoDof) : kChi2TwoDof;
  }
  adjusted.start.T_b_a = problem.T_cam_world.back();
  adjusted.start.is_planar = candidate.is_planar;
  adjusted.start.is_adjusted = true;
  std::vector<std::optional<std::size_t>> point_of_feature;
  for (std::size_t i = 0; i < points.size(); ++i) {
    point_of_feature.resize(std::max(point_of_feature.size(), points[i].feature_a + 1));
    point_of_feature[points[i].feature_a] = i;
  }
  for (const FeatureMatch& match : candidate.matches) {
    if (match.feature_a >= point_of_feature.size() || !point_of_feature[match.feature_a]) continue;
    const Eigen::Vector3d& p_a = problem.p_world[*point_of_feature[match.feature_a]];
    if (p_a.z() <= 0 || (adjusted.start.T_b_a * p_a).z() <= 0) continue;
    adjusted.start.matches.push_back(match);
    adjusted.start.p_a.push_back(p_a);
  }
  return adjusted;
}

// Where the motion is along the normal of the plane the two motions are one, and the adjustment
// takes both to the same place.
bool IsSame(const Pose& a, const Pose& b) {
  constexpr double kMaxRotation_rad = 0.003;  // about 2 px of 768
  constexpr double kMinCosine = 0.9986;       // 3 degrees
  return (a.Inverse() * b).RotationAngle() < kMaxRotation_rad &&
         a.translation().normalized().dot(b.translation().normalized()) > kMinCosine;
}

// Each candidate adjusted over all views; empty where they show too little in common.
std::vector<Adjusted> AdjustAll(const std::vector<TwoViewStart>& candidates, const View& a,
                                const View& b, const std::vector<BetweenView>& between,
                                const CameraModel& camera) {
  std::vector<SupportView> supports;
  for (const BetweenView& view : between) {
    SupportView support{view.progress, Locate(a, *view.view, view.matches)};
    if (support.places.size() >= kMinPlaces) supports.push_back(std::move(support));
  }
  if (supports.empty()) return {};  // two views fit either way
  supports.push_back({1, Locate(a, b, candidates.front().matches)});
  std::vector<CommonPoint> points = CommonPoints(candidates, a.features.size());
  if (points.size() < kMinPlaces || supports.back().places.size() < kMinPlaces) return {};
  AddPointsSeenBefore(candidates, a, supports, camera, points);
  std::vector<Adjusted> adjusted;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Pose& T_b_a = candidates[i].T_b_a;
    adjusted.push_back(
        Adjust(BuildProblem(points, i, T_b_a, a, supports, camera), points, candidates[i]));
  }
  return adjusted;
}

}  // namespace

bool IsRefuted(const TwoViewStart& candidate, const View& a, const View& b,
               const std::vector<BetweenView>& between, const CameraModel& camera) {
  // Of each observation of a point. Errors as large as they are taken to be would leave 1, as of
  // three views three of six coordinates are left to judge by; patches are found better than that:
  // right motions leave .02 to .2, and one that was neither of the two 1.07.
  constexpr double kMaxCost = 0.5;
  const std::vector<Adjusted> adjusted = AdjustAll({candidate}, a, b, between, camera);
  return !adjusted.empty() && Sum(adjusted.front().costs) >
                                  kMaxCost * static_cast<double>(adjusted.front().num_observations);
}

std::optional<TwoViewStart> SelectMotion(const std::vector<TwoViewStart>& candidates,
                                         const std::vector<TwoViewStart>& unlikely, const View& a,
                                         const View& b, const std::vector<BetweenView>& between,
                                         const CameraModel& camera) {
  if (candidates.empty()) return std::nullopt;
  std::vector<TwoViewStart> all = candidates;
  all.insert(all.end(), unlikely.begin(), unlikely.end());
  if (all.size() == 1) return all.front();
  std::vector<Adjusted> adjusted = AdjustAll(all, a, b, between, camera);
  if (adjusted.empty()) {
    return candidates.size() == 1 ? std::optional(candidates.front()) : std::nullopt;
  }
  const std::span<Adjusted> everything(adjusted);
  const std::span<Adjusted> likely = everything.first(candidates.size());
  const auto best_of = [](std::span<Adjusted> some) -> Adjusted& {
    return *std::ranges::min_element(some, {}, [](const Adjusted& of) { return Sum(of.costs); });
  };
  // Another one that is neither the same nor clearly worse.
  const auto has_rival = [](const Adjusted& best, std::span<Adjusted> others) {
    return std::ranges::any_of(others, [&](const Adjusted& other) {
      return &other != &best && !IsSame(best.start.T_b_a, other.start.T_b_a) &&
             !IsClearlyBetter(best.costs, other.costs);
    });
  };
  Adjusted& best = best_of(everything);
  const bool is_over_all = !has_rival(best, likely);
  // Not so much better than the likely ones, an unlikely one is none to wait for.
  Adjusted& chosen = is_over_all ? best : best_of(likely);
  const bool is_likely = &chosen < likely.data() + likely.size();
  if (has_rival(chosen, is_likely ? likely : everything)) return std::nullopt;
  return std::move(chosen.start);
}

}  // namespace mono3d::tracking
