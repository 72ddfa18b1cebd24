// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/start/image_bundle_map.h"

#include <algorithm>
#include <utility>

#include "tracking/alignment/point_patches.h"
#include "tracking/features/feature_tracking.h"
#include "tracking/features/matching.h"
#include "tracking/mapping/point_creation.h"
#include "tracking/mapping/point_fusion.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/pose_optimisation.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/relocaliser.h"
#include "tracking/start/map_start.h"

namespace mono3d::tracking {
namespace {

// A view at the pose that its matches with the map give it.
struct Registration {
  std::size_t view = 0;
  View posed;
  int num_inliers = 0;
};

Registration Register(Map& map, const View& view, std::size_t index, int seed) {
  Registration best;
  best.view = index;
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    View posed = view;
    PoseResult pose = FindPoseByKeyframe(map, id, posed, seed);
    if (pose.num_inliers < kMinPoseInliers) continue;
    pose = TrackLocalMap(map, posed);
    if (pose.num_inliers <= best.num_inliers) continue;
    best.num_inliers = pose.num_inliers;
    best.posed = std::move(posed);
  }
  return best;
}

// The one among the views left that sees most of the map.
Registration RegisterBest(Map& map, const std::vector<View>& views,
                          const std::vector<std::size_t>& left, int seed) {
  Registration best;
  best.view = left.front();
  for (const std::size_t index : left) {
    Registration registration = Register(map, views[index], index, seed);
    if (registration.num_inliers > best.num_inliers) best = std::move(registration);
  }
  return best;
}

// Moves the features that have a point to where its patch is, to a fraction of a pixel.
void RefineBundleByPatchAlignment(const Map& map, View& view) {
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!view.points[i]) continue;
    const auto found = FindPatch(map, *view.points[i], view, view.features[i].pixel);
    if (!found) continue;
    view.features[i].pixel = found->pixel;
    view.features[i].sigma_px = found->sigma_px;
  }
}

// With all that the images say of how the surfaces lie, each feature once more.
void RefineAllByPatchAlignment(Map& map) {
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) EstimatePatchNormals(map, id);
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id)
    RefineBundleByPatchAlignment(map, map.keyframe(id).view);
}

}  // namespace

ImageBundleMap GrowMap(const std::vector<View>& views, const ImageBundleStart& start,
                       const ImageBundlePosesOptions& options) {
  LocalMappingOptions mapping;
  mapping.num_neighbours = static_cast<int>(views.size());  // all of them
  FeatureOptions features;
  features.num_features = options.num_features;
  ImageBundleMap grown;
  grown.map = std::make_unique<Map>(0, views[start.a].frame.camera, features);
  Map& map = *grown.map;
  FillMap({views[start.a], views[start.b], start.motion}, map);
  std::vector<KeyframeId> keyframe_of_view(views.size());
  keyframe_of_view[start.b] = 1;
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i != start.a && i != start.b) left.push_back(i);
  }
  while (!left.empty()) {
    Registration next = RegisterBest(map, views, left, options.seed);
    if (next.num_inliers < options.min_inliers) {
      grown.reason = views[next.view].frame.name + ": " + std::to_string(next.num_inliers) +
                     " scene points found again, " + std::to_string(options.min_inliers) +
                     " needed";
      return grown;
    }
    RefineBundleByPatchAlignment(map, next.posed);
    RefinePose(map, next.posed);
    const KeyframeId id = map.AddKeyframe(std::move(next.posed));
    keyframe_of_view[next.view] = id;
    CreatePoints(map, id, mapping);
    FusePoints(map, id, mapping);
    AdjustAll(map);
    std::erase(left, next.view);
  }
  // With all poses known, every pair of views gives points.
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    CreatePoints(map, id, mapping);
    FusePoints(map, id, mapping);
  }
  AdjustAll(map);
  RefineAllByPatchAlignment(map);
  ExtendTracks(map);
  AdjustAll(map);
  grown.keyframe_of_view = std::move(keyframe_of_view);
  grown.score = ScoreOf(map);
  return grown;
}

double ScoreOf(const Map& map) {
  double score = 0;
  for (const MapPoint& point : map.points()) {
    if (!point.alive) continue;
    score -= 1.5 * kChi2TwoDof;
    for (const Observation& observation : point.observations) {
      const View& view = map.keyframe(observation.keyframe).view;
      const Feature& feature = view.features[observation.feature];
      const Eigen::Vector3d p_cam = view.T_cam_world * point.p_world;
      if (p_cam.z() <= 0) continue;
      const double error = (map.camera().Project(p_cam) - feature.pixel).squaredNorm();
      score += std::max(0.0, kChi2TwoDof - error / (feature.sigma_px * feature.sigma_px));
    }
  }
  return score;
}

void ExtendTracks(Map& map) {
  for (const PointId id : map.PointIds()) {
    if (!map.point(id).patch) continue;
    for (KeyframeId keyframe = 0; keyframe < map.keyframes().size(); ++keyframe) {
      if (map.FeatureOf(id, keyframe)) continue;
      const View& view = map.keyframe(keyframe).view;
      const std::optional<ProjectedPoint> at = ProjectMapPoint(map, id, view);
      if (!at) continue;
      const std::optional<Feature> found = FindPatch(map, id, view, at->pixel);
      if (found) map.AddObservation(id, keyframe, *found);
    }
    map.UpdatePoint(id);
  }
}

}  // namespace mono3d::tracking
