// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/frame_tracking.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <vector>

#include "tracking/image_shift.h"
#include "tracking/matching.h"
#include "tracking/pose_optimisation.h"

namespace mono3d::tracking {
namespace {

// Below this the pose of a first match is not worth keeping.
constexpr int kFewMatches = 20;
// Of a place looked for by descriptors alone, from where much has come to look otherwise: that it
// is the right one must show by what else of the map is found from there.
constexpr int kFewOfPlace = 10;

void ClearPoints(View& view) { view.points.assign(view.features.size(), std::nullopt); }

void Assign(const std::vector<PointMatch>& matches, View& view) {
  for (const PointMatch& match : matches) view.points[match.feature] = match.point;
}

std::vector<ProjectedPoint> ProjectPrevious(const Map& map, const View& previous, const View& view,
                                            double radius_levels_px) {
  std::vector<ProjectedPoint> projected;
  for (std::size_t i = 0; i < previous.points.size(); ++i) {
    if (!previous.points[i] || !map.point(*previous.points[i]).alive) continue;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*previous.points[i]).p_world;
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = map.camera().Project(p_cam);
    if (!map.camera().Contains(pixel)) continue;
    const Feature& seen = previous.features[i];
    projected.push_back({*previous.points[i], pixel,
                         radius_levels_px * map.scales().Scale(seen.level), seen.level - 1,
                         seen.level + 1, seen.descriptor, seen.angle_deg});
  }
  return projected;
}

// The points of the keyframes that see what the view sees, and of their closest neighbours, without
// those that the view has already.
std::vector<PointId> LocalPoints(const Map& map, const View& view) {
  constexpr std::size_t kMaxKeyframes = 20;
  std::vector<KeyframeId> keyframes;
  std::vector<char> is_listed(map.keyframes().size(), 0);
  const auto list = [&](KeyframeId id) {
    if (is_listed[id] != 0 || keyframes.size() >= kMaxKeyframes) return;
    is_listed[id] = 1;
    keyframes.push_back(id);
  };
  for (const Covisible& seeing : map.KeyframesSeeing(view.points)) list(seeing.keyframe);
  std::vector<char> is_taken(map.points().size(), 0);
  for (const std::optional<PointId>& point : view.points) {
    if (point) is_taken[*point] = 1;
  }
  std::vector<PointId> points;
  for (const KeyframeId id : keyframes) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || is_taken[*point] != 0) continue;
      is_taken[*point] = 1;
      points.push_back(*point);
    }
  }
  return points;
}

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
  constexpr int kRounds = 300;
  constexpr float kMaxError = 5;  // px: coarse levels are in it; the refinement is stricter
  if (!cv::solvePnPRansac(points, pixels, K, cv::noArray(), rotation_vector, translation, false,
                          kRounds, kMaxError, 0.99, inliers, cv::SOLVEPNP_P3P)) {
    return std::nullopt;
  }
  if (static_cast<int>(inliers.size()) < kFewOfPlace) return std::nullopt;
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
  constexpr double kRadiusShare = 0.13;  // of the image width, as at the start
  const int max_level = map.scales().num_levels() - 1;
  const auto shift_px = CommonShift(keyframe, has_point, view, max_level);
  if (!shift_px) return {};
  std::vector<FeatureMatch> matches =
      MatchNearby(keyframe, view, {kRadiusShare * map.camera().width, max_level, *shift_px});
  std::erase_if(matches, [&](const auto& match) { return has_point[match.feature_a] == 0; });
  return matches;
}

// `view` gets pose and points only when it works.
PoseResult PoseFrom(const Map& map, const View& keyframe, const std::vector<FeatureMatch>& matches,
                    View& view, int seed) {
  if (static_cast<int>(matches.size()) < kFewMatches) return {};
  const std::optional<PnpSolution> solution = SolvePnp(map, keyframe, view, matches, seed);
  if (!solution) return {};
  View attempt = view;
  ClearPoints(attempt);
  for (const FeatureMatch& match : solution->inliers) {
    attempt.points[match.feature_b] = keyframe.points[match.feature_a];
  }
  attempt.T_cam_world = solution->T_cam_world;
  const PoseResult result = RefinePose(map, attempt);
  if (result.num_inliers < kFewOfPlace) return {};
  view = std::move(attempt);
  return result;
}

}  // namespace

Pose ScaleMotion(const Pose& motion, double factor) {
  return {RotationExp(factor * RotationLog(motion.rotation())), factor * motion.translation()};
}

PoseResult RefinePose(const Map& map, View& view) {
  std::vector<PointMeasurement> measurements;
  std::vector<std::size_t> features;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    const Feature& feature = view.features[i];
    measurements.push_back({map.point(*view.points[i]).p_world, feature.pixel, feature.sigma_px});
    features.push_back(i);
  }
  if (measurements.size() < 4) {
    ClearPoints(view);
    return {};
  }
  const PoseEstimate estimate = OptimisePose(map.camera(), view.T_cam_world, measurements);
  view.T_cam_world = estimate.T_cam_world;
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (estimate.is_inlier[k] == 0) view.points[features[k]].reset();
  }
  return {estimate.num_inliers, estimate.reprojection_px};
}

PoseResult TrackFromPrevious(const Map& map, const View& previous, View& view) {
  const Pose predicted = view.T_cam_world;
  PoseResult result;
  // px on level 0; the wider one for a sudden change of speed.
  for (const double radius : {15.0, 40.0}) {
    ClearPoints(view);
    view.T_cam_world = predicted;
    const std::vector<PointMatch> matches =
        MatchProjected(ProjectPrevious(map, previous, view, radius), view, {});
    if (static_cast<int>(matches.size()) < kFewMatches) continue;
    Assign(matches, view);
    result = RefinePose(map, view);
    if (result.num_inliers >= kFewMatches) return result;
  }
  return result;
}

PoseResult TrackFromKeyframe(const Map& map, KeyframeId id, View& view) {
  ClearPoints(view);
  const View& keyframe = map.keyframe(id).view;
  std::vector<char> has_point;
  for (const std::optional<PointId>& point : keyframe.points) has_point.push_back(point ? 1 : 0);
  const std::vector<char> all(view.features.size(), 1);
  const std::vector<FeatureMatch> matches = MatchDescriptors(keyframe, has_point, view, all);
  if (static_cast<int>(matches.size()) < kFewMatches) return {};
  for (const FeatureMatch& match : matches) {
    view.points[match.feature_b] = keyframe.points[match.feature_a];
  }
  return RefinePose(map, view);
}

PoseResult TrackLocalMap(Map& map, View& view) {
  const std::vector<PointId> local = LocalPoints(map, view);
  std::vector<ProjectedPoint> projected;
  for (const PointId point : local) {
    const std::optional<ProjectedPoint> at = ProjectMapPoint(map, point, view);
    if (at) projected.push_back(*at);
  }
  for (const std::optional<PointId>& point : view.points) {
    if (point) ++map.point(*point).num_predicted;
  }
  for (const ProjectedPoint& point : projected) ++map.point(point.point).num_predicted;
  constexpr double kRatio = 0.8;
  Assign(MatchProjected(projected, view, {.max_ratio = kRatio}), view);
  const PoseResult result = RefinePose(map, view);
  for (const std::optional<PointId>& point : view.points) {
    if (point) ++map.point(*point).num_found;
  }
  return result;
}

PoseResult Relocalise(const Map& map, KeyframeId id, View& view, int seed) {
  const View& keyframe = map.keyframe(id).view;
  std::vector<char> has_point;
  for (const std::optional<PointId>& point : keyframe.points) has_point.push_back(point ? 1 : 0);
  const std::vector<char> all(view.features.size(), 1);
  const PoseResult result =
      PoseFrom(map, keyframe, MatchDescriptors(keyframe, has_point, view, all), view, seed);
  if (result.num_inliers >= kFewMatches) return result;
  View shifted = view;
  const PoseResult by_shift =
      PoseFrom(map, keyframe, MatchByShift(map, keyframe, has_point, view), shifted, seed);
  if (by_shift.num_inliers <= result.num_inliers) return result;
  view = std::move(shifted);
  return by_shift;
}

}  // namespace mono3d::tracking
