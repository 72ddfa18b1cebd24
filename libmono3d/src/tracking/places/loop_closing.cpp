// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/loop_closing.h"

#include <algorithm>
#include <cmath>

#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/alignment/point_patches.h"
#include "tracking/features/matching.h"
#include "tracking/map/point_set.h"
#include "tracking/mapping/point_fusion.h"
#include "tracking/optimisation/keyframe_graph.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/map_constraints.h"

namespace mono3d::tracking {
namespace {

// Points with which two keyframes count as connected (Mur-Artal, Montiel, Tardos 2015, section
// III).
constexpr int kMinShared = 15;

// The keyframes that share points with the newest one, and those too young to be a loop, which only
// lost sight for a moment.
std::vector<char> NotAskedFor(const Map& map, KeyframeId keyframe,
                              const std::vector<Covisible>& covisible) {
  std::vector<char> is_left_out(map.keyframes().size(), 0);
  const KeyframeId first_young = keyframe + 1 - std::min(keyframe + 1, kMinReturnGap);
  for (KeyframeId id = first_young; id < is_left_out.size(); ++id) is_left_out[id] = 1;
  for (const Covisible& other : covisible) is_left_out[other.keyframe] = 1;
  return is_left_out;
}

// Does a keyframe share points with one that shares points with the newest?
bool IsConnected(const Map& map, KeyframeId candidate, const std::vector<Covisible>& covisible) {
  const std::vector<Covisible> of_candidate = map.CovisibleKeyframes(candidate);
  return std::any_of(of_candidate.begin(), of_candidate.end(), [&](const Covisible& second) {
    return second.num_shared >= kMinShared &&
           std::any_of(covisible.begin(), covisible.end(), [&](const Covisible& first) {
             return first.keyframe == second.keyframe && first.num_shared >= kMinShared;
           });
  });
}

std::vector<KeyframeId> LoopCandidates(const Map& map, const PlaceIndex& index,
                                       KeyframeId keyframe) {
  constexpr std::size_t kMaxQueried = 40;  // before the connected ones are left out
  const std::vector<Covisible> covisible = map.CovisibleKeyframes(keyframe);
  std::vector<KeyframeId> candidates;
  const std::vector<Feature> features = FeaturesWithPoints(map.keyframe(keyframe).view);
  for (const PlaceMatch& match :
       index.Query(features, kMaxQueried, NotAskedFor(map, keyframe, covisible))) {
    if (match.num_votes < kMinVotes || candidates.size() >= kMaxPlaceCandidates) break;
    if (!IsConnected(map, match.keyframe, covisible)) candidates.push_back(match.keyframe);
  }
  return candidates;
}

// The points that the old keyframe and its closest neighbours see.
std::vector<PointId> PointsAroundLoop(const Map& map, KeyframeId keyframe) {
  constexpr std::size_t kMaxNeighbours = 10;  // as many as a local adjustment has
  std::vector<KeyframeId> keyframes = {keyframe};
  for (const Covisible& other : map.CovisibleKeyframes(keyframe)) {
    if (keyframes.size() > kMaxNeighbours) break;
    keyframes.push_back(other.keyframe);
  }
  std::vector<PointId> points;
  PointSet listed(map);
  for (const KeyframeId id : keyframes) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || !listed.Insert(*point)) continue;
      points.push_back(*point);
    }
  }
  return points;
}

// The keyframe, if its image is still there, comes to see the points whose patches are found in it.
void ShowPoints(Map& map, const std::vector<PointId>& points, KeyframeId keyframe) {
  const View& view = map.keyframe(keyframe).view;
  if (view.octaves.empty()) return;
  for (const PointId point : points) {
    if (!map.IsAlive(point) || map.FeatureOf(point, keyframe)) continue;
    const std::optional<ProjectedPoint> at = ProjectMapPoint(map, point, view);
    if (!at) continue;
    const std::optional<Feature> found = FindPatch(map, point, view, at->pixel);
    if (!found) continue;
    map.AddObservation(point, keyframe, *found);
    map.UpdatePoint(point);
  }
}

}  // namespace

std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed) {
  for (const KeyframeId candidate : LoopCandidates(map, index, keyframe)) {
    std::optional<PlaceFound> loop = MatchPlace(map, keyframe, map, candidate, seed);
    if (loop) return loop;
  }
  return std::nullopt;
}

void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
               MappingLock& lock) {
  KeyframeGraph graph = BuildGraph(map);
  const Pose T_new_old = loop.T_cam_world * map.T_cam_world(loop.old_keyframe).Inverse();
  graph.AddLoop(loop.old_keyframe, loop.keyframe,
                Similarity(1 / loop.scale, Pose()) * Similarity(1, T_new_old));
  const double length = UpperMedianOrZero(map.Depths(map.keyframe(loop.keyframe).view));
  const KeyframeId num_keyframes = map.keyframes().size();
  const GraphConstraints constraints = ConstraintsOf(map, graph);
  {
    const ScopedUnlock away(lock);
    OptimisePoseGraph(graph.S_cam_world, graph.edges, length > 0 ? length : 1, constraints);
  }
  AddNewer(map, num_keyframes, loop.keyframe, graph);
  map.Correct(graph.keyframes, graph.S_cam_world);
  MergePlaces(map, loop, options, lock);
}

void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
                 MappingLock& lock) {
  for (const auto& [own, old] : loop.same) {
    if (map.IsAlive(own) && map.IsAlive(old)) map.MergePoints(own, old);
  }
  // The newest keyframes see the old points as well: this is what holds both ends together.
  const std::vector<PointId> old_points = PointsAroundLoop(map, loop.old_keyframe);
  constexpr KeyframeId kNewest = 5;  // keyframes, whose images are still there in any case
  std::vector<KeyframeId> around = {loop.keyframe};
  for (const Covisible& other : map.CovisibleKeyframes(loop.keyframe)) {
    if (other.keyframe + kNewest >= loop.keyframe) around.push_back(other.keyframe);
  }
  for (const KeyframeId id : around) ShowPoints(map, old_points, id);
  // With more than new points are made with: the old keyframes share few points yet, and come last.
  LocalMappingOptions wider = options;
  wider.num_neighbours = std::max(options.num_neighbours, 6);
  for (const KeyframeId id : around) FusePoints(map, id, wider);
  if (!lock.IsShared()) AdjustAllAndScales(map, lock);
}

}  // namespace mono3d::tracking
