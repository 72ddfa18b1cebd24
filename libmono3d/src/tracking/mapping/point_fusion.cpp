// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/mapping/point_fusion.h"

#include <cstddef>
#include <optional>
#include <vector>

#include "tracking/alignment/point_patches.h"
#include "tracking/features/descriptor.h"
#include "tracking/features/matching.h"
#include "tracking/map/point_set.h"

namespace mono3d::tracking {
namespace {

// The keyframe comes to see the points that show where it has a feature.
void FuseInto(Map& map, KeyframeId target, const std::vector<PointId>& points) {
  const View& view = map.keyframe(target).view;
  std::vector<ProjectedPoint> projected;
  for (const PointId point : points) {
    if (!map.IsAlive(point) || map.FeatureOf(point, target)) continue;
    std::optional<ProjectedPoint> at = ProjectMapPoint(map, point, view);
    if (!at) continue;
    constexpr double kRadius = 3;  // px of the level: three times the deviation of a key point
    at->radius_px = kRadius * map.scales().Scale(at->max_level);
    projected.push_back(*at);
  }
  const MatchRule rule{.max_distance = kCloseDistance, .take_occupied = true};
  for (const PointMatch& match : MatchProjected(projected, view, rule)) {
    const Feature& feature = view.features[match.feature];
    if (!map.IsAlive(match.point) || map.FeatureOf(match.point, target)) continue;
    const Eigen::Vector3d p_cam = view.T_cam_world * map.point(match.point).p_world;
    if (!ShowsAt(map.camera(), view, p_cam, feature)) continue;
    const std::optional<PointId> present = view.points[match.feature];
    if (!present) {
      Feature& refined = map.keyframe(target).view.features[match.feature];
      if (const auto aligned = FindPatch(map, match.point, view, refined.pixel)) {
        refined.pixel = aligned->pixel;
        refined.sigma_px = aligned->sigma_px;
      } else if (!view.octaves.empty()) {
        continue;
      }
      map.AddObservation(match.point, {target, match.feature});
      map.UpdatePoint(match.point);
      continue;
    }
    const bool keep_present =
        map.point(*present).observations.size() > map.point(match.point).observations.size();
    map.MergePoints(keep_present ? match.point : *present, keep_present ? *present : match.point);
  }
}

std::vector<PointId> PointsOf(const View& view) {
  std::vector<PointId> points;
  for (const std::optional<PointId>& point : view.points) {
    if (point) points.push_back(*point);
  }
  return points;
}

}  // namespace

void FusePoints(Map& map, KeyframeId keyframe, const LocalMappingOptions& options) {
  const std::vector<Covisible> neighbours =
      map.CovisibleKeyframes(keyframe, static_cast<std::size_t>(options.num_neighbours));
  const std::vector<PointId> own = PointsOf(map.keyframe(keyframe).view);
  for (const Covisible& neighbour : neighbours) FuseInto(map, neighbour.keyframe, own);
  std::vector<PointId> theirs;
  PointSet listed(map);
  for (const Covisible& neighbour : neighbours) {
    for (const PointId point : PointsOf(map.keyframe(neighbour.keyframe).view)) {
      if (listed.Insert(point)) theirs.push_back(point);
    }
  }
  FuseInto(map, keyframe, theirs);
}

}  // namespace mono3d::tracking
