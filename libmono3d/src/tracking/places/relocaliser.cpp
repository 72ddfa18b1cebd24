// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/relocaliser.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <optional>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/features/feature_tracking.h"
#include "tracking/features/image_shift.h"
#include "tracking/features/matching.h"
#include "tracking/optimisation/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

struct PnpSolution {
  Pose T_cam_world;
  std::vector<FeatureMatch> inliers;
};

// Three points at a time within RANSAC, then all that fit at once (SQPnP): either holds on flat
// ground too, where the common EPnP takes the mirrored pose.
std::optional<PnpSolution> SolvePnp(const Map& map, const View& keyframe, const View& view,
                                    const std::vector<FeatureMatch>& matches, int seed) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector3d& p = map.point(*keyframe.points[match.feature_a]).p_world;
    const Eigen::Vector2d& pixel = view.features[match.feature_b].pixel;
    points.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  cv::Mat K;
  cv::eigen2cv(map.camera().Matrix(), K);
  cv::Mat rotation_vector;
  cv::Mat translation;
  std::vector<int> inliers;
  cv::theRNG().state = static_cast<std::uint64_t>(seed);
  constexpr int kRounds = 300;    // finds three good ones among 30 % with a certainty of 99.9 %
  constexpr float kMaxError = 5;  // px: coarse levels are in it; the refinement is stricter
  if (!cv::solvePnPRansac(points, pixels, K, cv::noArray(), rotation_vector, translation, false,
                          kRounds, kMaxError, 0.99, inliers, cv::SOLVEPNP_P3P)) {
    return std::nullopt;
  }
  if (static_cast<int>(inliers.size()) < kMinPoseInliers) return std::nullopt;
  PnpSolution solution;
  std::vector<cv::Point3d> fitting_points;
  std::vector<cv::Point2d> fitting_pixels;
  for (const int i : inliers) {
    const auto index = static_cast<std::size_t>(i);
    solution.inliers.push_back(matches[index]);
    fitting_points.push_back(points[index]);
    fitting_pixels.push_back(pixels[index]);
  }
  if (!cv::solvePnP(fitting_points, fitting_pixels, K, cv::noArray(), rotation_vector, translation,
                    false, cv::SOLVEPNP_SQPNP)) {
    return std::nullopt;
  }
  Eigen::Vector3d omega;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation_vector, omega);
  cv::cv2eigen(translation, t);
  solution.T_cam_world = Pose(RotationExp(omega), t);
  return solution;
}

// Texture that repeats has few descriptors of its own kind: there, matches near where most of the
// image has gone.
std::vector<FeatureMatch> MatchByShift(const Map& map, const View& keyframe,
                                       const std::vector<char>& has_point, const View& view) {
  const int max_level = map.scales().num_levels() - 1;
  const auto shift_px = CommonShift(keyframe, has_point, view, max_level);
  if (!shift_px) return {};
  std::vector<FeatureMatch> matches = MatchNearby(
      keyframe, view,
      {InitialisationOptions{}.search_radius_share * map.camera().width, max_level, *shift_px});
  std::erase_if(matches, [&](const auto& match) { return has_point[match.feature_a] == 0; });
  return matches;
}

// `view` gets pose and points only when it works.
PoseResult PoseFrom(const Map& map, const View& keyframe, const std::vector<FeatureMatch>& matches,
                    View& view, int seed) {
  if (static_cast<int>(matches.size()) < kMinMatches) return {};
  const std::optional<PnpSolution> solution = SolvePnp(map, keyframe, view, matches, seed);
  if (!solution) return {};
  View attempt = view;
  attempt.points.assign(attempt.features.size(), std::nullopt);
  for (const FeatureMatch& match : solution->inliers) {
    attempt.points[match.feature_b] = keyframe.points[match.feature_a];
  }
  attempt.T_cam_world = solution->T_cam_world;
  const PoseResult result = RefinePose(map, attempt);
  if (result.num_inliers < kMinPoseInliers) return {};
  view = std::move(attempt);
  return result;
}

// The keyframes that look most like the view, then the newest.
std::vector<KeyframeId> RelocalisationCandidates(const Map& map, const PlaceIndex& places,
                                                 const View& view) {
  constexpr std::size_t kMaxCandidates = 8;  // what a frame has time for
  std::vector<KeyframeId> candidates;
  for (const PlaceMatch& place : LikelyPlaces(map, places, view)) {
    candidates.push_back(place.keyframe);
  }
  for (KeyframeId id = map.keyframes().size(); id-- > 0 && candidates.size() < kMaxCandidates;) {
    const bool is_listed = std::find(candidates.begin(), candidates.end(), id) != candidates.end();
    if (map.keyframe(id).alive && !is_listed) candidates.push_back(id);
  }
  return candidates;
}

}  // namespace

PoseResult FindPoseByKeyframe(const Map& map, KeyframeId id, View& view, int seed) {
  const View& keyframe = map.keyframe(id).view;
  std::vector<char> has_point;
  for (const std::optional<PointId>& point : keyframe.points) has_point.push_back(point ? 1 : 0);
  const std::vector<char> all(view.features.size(), 1);
  const PoseResult result =
      PoseFrom(map, keyframe, MatchDescriptors(keyframe, has_point, view, all), view, seed);
  if (result.num_inliers >= kMinMatches) return result;
  View shifted = view;
  const PoseResult by_shift =
      PoseFrom(map, keyframe, MatchByShift(map, keyframe, has_point, view), shifted, seed);
  if (by_shift.num_inliers <= result.num_inliers) return result;
  view = std::move(shifted);
  return by_shift;
}

std::vector<PlaceMatch> LikelyPlaces(const Map& map, const PlaceIndex& places, const View& view) {
  constexpr std::size_t kMaxPlaces = 5;  // of the candidates; the others are the newest keyframes
  std::vector<PlaceMatch> likely = places.Query(view.features, kMaxPlaces);
  std::erase_if(likely,
                [&](const PlaceMatch& place) { return !map.keyframe(place.keyframe).alive; });
  return likely;
}

PoseResult Relocaliser::Relocalise(Map& map, const PlaceIndex& places, View& view) const {
  const int needed = min_inliers_ * 5 / 3;
  PoseResult best;
  for (const KeyframeId id : RelocalisationCandidates(map, places, view)) {
    PoseResult pose = FindPoseByKeyframe(map, id, view, seed_);
    if (pose.num_inliers >= kMinPoseInliers) pose = TrackLocalMap(map, view);
    if (pose.num_inliers >= needed) return pose;
    if (pose.num_inliers > best.num_inliers) best = pose;
  }
  best.num_inliers = std::min(best.num_inliers, min_inliers_ - 1);
  return best;
}

}  // namespace mono3d::tracking
