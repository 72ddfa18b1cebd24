// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/feature_tracking.h"

#include <algorithm>
#include <vector>

#include "tracking/features/descriptor.h"
#include "tracking/features/matching.h"
#include "tracking/map/point_set.h"

namespace mono3d::tracking {
namespace {

void ClearPoints(View& view) { view.points.assign(view.features.size(), std::nullopt); }

void Assign(const std::vector<PointMatch>& matches, View& view) {
  for (const PointMatch& match : matches) view.points[match.feature] = match.point;
}

std::vector<ProjectedPoint> ProjectPrevious(const Map& map, const View& previous, const View& view,
                                            double radius_levels_px) {
  std::vector<ProjectedPoint> projected;
  for (std::size_t i = 0; i < previous.points.size(); ++i) {
    if (!previous.points[i] || !map.IsAlive(*previous.points[i])) continue;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(*previous.points[i]).p_world;
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = view.shutter.Project(map.camera(), p_cam);
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
  constexpr std::size_t kMaxKeyframes = 20;  // bounds the time of a frame
  std::vector<KeyframeId> keyframes;
  std::vector<char> is_listed(map.keyframes().size(), 0);
  const auto list = [&](KeyframeId id) {
    if (is_listed[id] != 0 || keyframes.size() >= kMaxKeyframes) return;
    is_listed[id] = 1;
    keyframes.push_back(id);
  };
  for (const Covisible& seeing : map.KeyframesSeeing(view.points)) list(seeing.keyframe);
  PointSet taken(map);
  for (const std::optional<PointId>& point : view.points) {
    if (point) taken.Insert(*point);
  }
  std::vector<PointId> points;
  for (const KeyframeId id : keyframes) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (point && taken.Insert(*point)) points.push_back(*point);
    }
  }
  return points;
}

}  // namespace

PoseResult TrackFromPrevious(const Map& map, const View& previous, View& view) {
  const Pose predicted = view.T_cam_world;
  PoseResult result;
  // px on level 0; the wider one for a sudden change of speed.
  for (const double radius : {15.0, 40.0}) {
    ClearPoints(view);
    view.T_cam_world = predicted;
    const std::vector<PointMatch> matches =
        MatchProjected(ProjectPrevious(map, previous, view, radius), view, {});
    if (static_cast<int>(matches.size()) < kMinMatches) continue;
    Assign(matches, view);
    result = RefinePose(map, view);
    if (result.num_inliers >= kMinMatches) return result;
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
  if (static_cast<int>(matches.size()) < kMinMatches) return {};
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
  Assign(MatchProjected(projected, view, {.max_ratio = kMaxDistanceRatio}), view);
  const PoseResult result = RefinePose(map, view);
  for (const std::optional<PointId>& point : view.points) {
    if (point) ++map.point(*point).num_found;
  }
  return result;
}

}  // namespace mono3d::tracking
