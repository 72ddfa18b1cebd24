// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/two_view_start.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <numbers>
#include <span>
#include <sstream>
#include <utility>

#include "mono3d/geometry/fundamental.h"
#include "mono3d/geometry/homography.h"
#include "mono3d/geometry/triangulation.h"
#include "mono3d/geometry/two_view_ransac.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/reason.h"
#include "tracking/start/essential_fitting.h"
#include "tracking/start/match_alignment.h"
#include "tracking/start/model_comparison.h"

namespace mono3d::tracking {
namespace {

// Above it the scene is as good as planar (Mur-Artal, Montiel, Tardos 2015, section IV).
constexpr double kPlanarShare = 0.45;
// A motion wins if no other one has more than this share of its points.
constexpr double kClearPointsShare = 0.75;
constexpr double kCornerSigma_px = 1;
// px^2: twice that.
constexpr double kMaxSquaredError = 4 * kCornerSigma_px * kCornerSigma_px;

struct StartCandidate {
  TwoViewStart start;
  double parallax_deg = 0;  // the 50th largest
};

std::string TooLittleParallax(double found_deg, double needed_deg) {
  std::ostringstream text;
  text << std::setprecision(2) << "too little parallax: " << found_deg << " degrees, " << needed_deg
       << " needed";
  return text.str();
}

// Triangulates the inliers under one motion and keeps those that fit.
StartCandidate Test(const Pose& T_b_a, const std::vector<PointPair>& pairs,
                    const std::vector<FeatureMatch>& matches, const TwoViewModel& model,
                    const CameraModel& camera) {
  StartCandidate candidate;
  candidate.start.T_b_a = T_b_a;
  const Eigen::Vector3d centre_b = T_b_a.Inverse().translation();
  std::vector<double> cosines;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (model.is_inlier[i] == 0) continue;
    const std::optional<Eigen::Vector3d> p_a =
        Triangulate(camera.Unproject(pairs[i].a), camera.Unproject(pairs[i].b), T_b_a);
    if (!p_a) continue;
    if ((camera.Project(*p_a) - pairs[i].a).squaredNorm() > kMaxSquaredError) continue;
    if ((camera.Project(T_b_a * *p_a) - pairs[i].b).squaredNorm() > kMaxSquaredError) continue;
    cosines.push_back(CosParallax(*p_a, Eigen::Vector3d::Zero(), centre_b));
    candidate.start.matches.push_back(matches[i]);
    candidate.start.p_a.push_back(*p_a);
  }
  if (cosines.empty()) return candidate;
  const std::size_t rank = std::min<std::size_t>(50, cosines.size() - 1);
  std::nth_element(cosines.begin(), cosines.begin() + static_cast<std::ptrdiff_t>(rank),
                   cosines.end());
  candidate.parallax_deg = std::acos(std::min(1.0, cosines[rank])) * 180 / std::numbers::pi;
  return candidate;
}

// What the views share, and how it is to be read.
struct Shared {
  const std::vector<PointPair>& pairs;
  const std::vector<FeatureMatch>& matches;
  const CameraModel& camera;
  const InitialisationOptions& options;
  int num_explained = 0;  // pairs, by the model that explains most
};

std::size_t NumPoints(const StartCandidate& candidate) { return candidate.start.p_a.size(); }

// Those of the four motions of an essential matrix that have the points before both cameras.
std::vector<StartCandidate> MotionsInFront(const Eigen::Matrix3d& essential, const Shared& shared,
                                           const TwoViewModel& model) {
  std::vector<StartCandidate> candidates;
  for (const Pose& T_b_a : DecomposeEssential(essential)) {
    candidates.push_back(Test(T_b_a, shared.pairs, shared.matches, model, shared.camera));
  }
  std::ranges::stable_sort(candidates, std::ranges::greater(), NumPoints);
  const double least = kClearPointsShare * static_cast<double>(NumPoints(candidates.front()));
  std::erase_if(candidates, [&](const StartCandidate& candidate) {
    return static_cast<double>(NumPoints(candidate)) < least;
  });
  return candidates;
}

// The motions that a homography leaves open.
std::vector<StartCandidate> MotionsOverPlane(const Shared& shared, const TwoViewModel& model) {
  const Eigen::Matrix3d K = shared.camera.Matrix();
  std::vector<StartCandidate> candidates;
  for (const PlaneMotion& motion : DecomposeHomography(K.inverse() * model.matrix * K)) {
    candidates.push_back(Test(motion.T_b_a, shared.pairs, shared.matches, model, shared.camera));
  }
  std::ranges::stable_sort(candidates, std::ranges::greater(), NumPoints);
  return candidates;
}

std::vector<PointPair> Inliers(const Shared& shared, const TwoViewModel& model) {
  std::vector<PointPair> inliers;
  for (std::size_t i = 0; i < shared.pairs.size(); ++i) {
    if (model.is_inlier[i] != 0) inliers.push_back(shared.pairs[i]);
  }
  return inliers;
}

// The essential matrices that the inliers of a fundamental matrix leave open, the best first.
std::vector<EpipolarFit> FitEssentialsTo(const Shared& shared, const TwoViewModel& model) {
  const Eigen::Matrix3d K = shared.camera.Matrix();
  // All four have the same epipolar lines.
  const Pose guess = DecomposeEssential(K.transpose() * model.matrix * K).front();
  return FitEssentials(std::span(&guess, 1), Inliers(shared, model), shared.camera,
                       kCornerSigma_px);
}

// And the motions of these.
std::vector<StartCandidate> MotionsOverRelief(const Shared& shared, const TwoViewModel& model,
                                              const std::vector<EpipolarFit>& fits) {
  std::vector<StartCandidate> candidates;
  for (const EpipolarFit& fit : fits) {
    for (StartCandidate& candidate : MotionsInFront(fit.essential, shared, model)) {
      candidates.push_back(std::move(candidate));
    }
  }
  return candidates;
}

StartAttempt FromCandidates(const Shared& shared, std::vector<StartCandidate> candidates,
                            bool is_planar) {
  if (candidates.empty()) return {{}, {}, "too little parallax: the motion is a rotation"};
  const std::size_t most = NumPoints(*std::ranges::max_element(candidates, {}, NumPoints));
  const int needed = std::max(shared.options.min_points, shared.num_explained / 2);
  if (static_cast<int>(most) < needed) {
    return {{}, {}, NeededText(static_cast<int>(most), "points triangulated", needed)};
  }
  // Far points without parallax lie behind the cameras by chance, so where there is relief the
  // right motion may have fewer points than a wrong one.
  const double least =
      is_planar ? kClearPointsShare * static_cast<double>(most) : static_cast<double>(needed);
  std::erase_if(candidates, [&](const StartCandidate& candidate) {
    return static_cast<double>(NumPoints(candidate)) < least;
  });
  // One that explains the pairs without parallax may be right.
  const StartCandidate& nearest =
      is_planar ? candidates.front()
                : *std::ranges::min_element(candidates, {}, &StartCandidate::parallax_deg);
  if (nearest.parallax_deg < shared.options.min_parallax_deg) {
    return {{},
            {},
            TooLittleParallax(nearest.parallax_deg, shared.options.min_parallax_deg),
            static_cast<int>(NumPoints(nearest))};
  }
  StartAttempt attempt;
  for (StartCandidate& candidate : candidates) {
    candidate.start.is_planar = is_planar;
    attempt.candidates.push_back(std::move(candidate.start));
  }
  return attempt;
}

// Turns one set of rays onto the other (Kabsch 1976): least squares of the angles.
Eigen::Matrix3d TurnBetween(std::span<const PointPair> pairs, const CameraModel& camera) {
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (const PointPair& pair : pairs) {
    correlation +=
        camera.Unproject(pair.b).normalized() * camera.Unproject(pair.a).normalized().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

// Squared distances of the pairs from where the homography takes them, over their variance, those
// of outliers at the limit.
std::vector<double> TransferLosses(const Eigen::Matrix3d& H_b_a, std::span<const PointPair> pairs) {
  constexpr double kVariance_px2 = 2 * kCornerSigma_px * kCornerSigma_px;  // of both pixels
  std::vector<double> losses;
  losses.reserve(pairs.size());
  for (const PointPair& pair : pairs) {
    const Eigen::Vector2d found = (H_b_a * pair.a.homogeneous()).hnormalized();
    const double loss = (found - pair.b).squaredNorm() / kVariance_px2;
    losses.push_back(loss < kChi2TwoDof ? loss : kChi2TwoDof);
  }
  return losses;
}

// How well a turn on the spot explains the views. What it leaves is the noise and what the camera
// has moved.
struct TurnOnTheSpot {
  bool is_as_good = false;  // as the homography, within chance
  bool is_near = false;     // it leaves less than twice the noise
};

TurnOnTheSpot CompareWithTurn(const Shared& shared, const TwoViewModel& homography) {
  constexpr double kMinRatio = 4;  // of squares
  const std::vector<PointPair> pairs = Inliers(shared, homography);
  const Eigen::Matrix3d K = shared.camera.Matrix();
  const std::vector<double> by_turn =
      TransferLosses(K * TurnBetween(pairs, shared.camera) * K.inverse(), pairs);
  const std::vector<double> by_homography = TransferLosses(homography.matrix, pairs);
  return {!IsClearlyBetter(by_homography, by_turn), Sum(by_turn) < kMinRatio * Sum(by_homography)};
}

// A homography also fits where what is near is little beside what is far away. Its motions are then
// none that the views allow: what is near shows another one clearly better.
bool IsRefutedByRelief(const StartAttempt& over_plane, const Shared& shared,
                       const TwoViewModel& model, const std::vector<EpipolarFit>& fits) {
  if (fits.empty()) return false;
  const std::vector<PointPair> inliers = Inliers(shared, model);
  return std::ranges::all_of(over_plane.candidates, [&](const TwoViewStart& candidate) {
    return IsClearlyBetter(fits.front().losses, EpipolarLosses(candidate.T_b_a, inliers,
                                                               shared.camera, kCornerSigma_px));
  });
}

}  // namespace

StartAttempt StartFromTwoViews(const View& a, const View& b,
                               const std::vector<FeatureMatch>& matches, const CameraModel& camera,
                               const InitialisationOptions& options, int seed) {
  if (static_cast<int>(matches.size()) < options.min_matches) {
    return {{}, {}, NeededText(static_cast<int>(matches.size()), "matches", options.min_matches)};
  }
  std::vector<PointPair> pairs;
  for (const FeatureMatch& match : matches) {
    // Corners are sure to a pixel, which between views that have hardly moved is most of what
    // moves.
    const std::optional<PatchPosition> found = AlignMatch(a, b, match);
    const Eigen::Vector2d& in_b = found ? found->pixel : b.features[match.feature_b].pixel;
    pairs.push_back({a.image_motion.AtMiddleLine(a.features[match.feature_a].pixel),
                     b.image_motion.AtMiddleLine(in_b)});
  }
  TwoViewRansacOptions ransac;
  ransac.seed = seed;
  const std::optional<TwoViewModel> H = EstimateHomography(pairs, ransac);
  const std::optional<TwoViewModel> F = EstimateFundamental(pairs, ransac);
  if (!H && !F) return {{}, {}, "neither a homography nor a fundamental matrix fits the matches"};
  const double score_H = H ? H->score : 0;
  const double score_F = F ? F->score : 0;
  const Shared shared{pairs, matches, camera, options,
                      std::max(H ? H->num_inliers : 0, F ? F->num_inliers : 0)};
  StartAttempt over_plane;
  if (H) over_plane = FromCandidates(shared, MotionsOverPlane(shared, *H), true);
  if (!over_plane.candidates.empty()) {
    // A shift, and a turn against it, move the images nearly alike: where the camera went, and how
    // far, is told by noise.
    const TurnOnTheSpot turn = CompareWithTurn(shared, *H);
    over_plane.is_near_turn = turn.is_near;
    if (turn.is_as_good) {
      over_plane = {{}, {}, "too little parallax: a turn on the spot explains the views as well"};
    }
  }
  const bool is_planar = score_H > kPlanarShare * (score_H + score_F);
  if (!F || (is_planar && over_plane.candidates.empty())) return over_plane;
  const std::vector<EpipolarFit> fits = FitEssentialsTo(shared, *F);
  std::vector<TwoViewStart> unlikely;
  if (IsRefutedByRelief(over_plane, shared, *F, fits)) {
    unlikely = std::exchange(over_plane.candidates, {});
  } else if (is_planar) {
    return over_plane;
  }
  StartAttempt attempt = FromCandidates(shared, MotionsOverRelief(shared, *F, fits), false);
  attempt.unlikely = std::move(unlikely);
  if (attempt.candidates.empty()) {
    // Over ground that is nearly flat the epipoles are loose: a matrix that fits all pairs may be
    // that of no motion.
    return over_plane.candidates.empty() ? attempt : over_plane;
  }
  // Of views that have hardly moved, noise and a wrong camera choose the epipoles; a turn and a
  // shift against each other then look like parallax. One that does without it must fit worse.
  const auto num_points = static_cast<double>(attempt.candidates[0].p_a.size());
  return over_plane.num_without_parallax <= kClearPointsShare * num_points ? attempt : over_plane;
}

}  // namespace mono3d::tracking
