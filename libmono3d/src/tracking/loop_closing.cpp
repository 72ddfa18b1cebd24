// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/loop_closing.h"

#include <algorithm>
#include <cmath>

#include "tracking/direct_tracking.h"
#include "tracking/frame_tracking.h"
#include "tracking/keyframe_constraints.h"
#include "tracking/keyframe_graph.h"
#include "tracking/local_mapping.h"
#include "tracking/matching.h"
#include "tracking/point_creation.h"

namespace mono3d::tracking {
namespace {

constexpr int kMinShared = 15;  // points, with which two keyframes count as connected

// The keyframes that share points with the newest one, and those too young to be a loop.
std::vector<char> NotAskedFor(const Map& map, KeyframeId keyframe,
                              const std::vector<Covisible>& covisible) {
  constexpr KeyframeId kMinAge = 10;  // keyframes: younger ones only lost sight for a moment
  std::vector<char> is_left_out(map.keyframes().size(), 0);
  for (KeyframeId id = 0; id < is_left_out.size(); ++id) {
    is_left_out[id] = id + kMinAge > keyframe || !map.keyframe(id).alive ? 1 : 0;
  }
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

std::vector<KeyframeId> Candidates(const Map& map, const PlaceIndex& index, KeyframeId keyframe) {
  constexpr std::size_t kMaxQueried = 40;
  constexpr std::size_t kMaxCandidates = 2;
  const std::vector<Covisible> covisible = map.CovisibleKeyframes(keyframe);
  std::vector<KeyframeId> candidates;
  const std::vector<Feature> features = FeaturesWithPoints(map.keyframe(keyframe).view);
  for (const PlaceMatch& match :
       index.Query(features, kMaxQueried, NotAskedFor(map, keyframe, covisible))) {
    if (match.num_votes < kMinVotes || candidates.size() >= kMaxCandidates) break;
    if (!IsConnected(map, match.keyframe, covisible)) candidates.push_back(match.keyframe);
  }
  return candidates;
}

// z of the point of each feature, 0 where there is none, of each keyframe.
std::vector<std::vector<double>> DepthsByFeature(const Map& map) {
  std::vector<std::vector<double>> depths;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    std::vector<double>& of_keyframe = depths.emplace_back();
    for (const std::optional<PointId>& point : keyframe.view.points) {
      of_keyframe.push_back(point ? (keyframe.view.T_cam_world * map.point(*point).p_world).z()
                                  : 0);
    }
  }
  return depths;
}

// The adjustment has changed the scale around the keyframes as well: by the median over the points.
void NoteScales(const std::vector<std::vector<double>>& before, Map& map) {
  const std::vector<std::vector<double>> after = DepthsByFeature(map);
  std::vector<double> ratios(map.keyframes().size(), 1);
  for (KeyframeId id = 0; id < before.size(); ++id) {  // later ones were not in it
    if (!map.keyframe(id).alive) continue;
    std::vector<float> of_points;
    for (std::size_t i = 0; i < after[id].size(); ++i) {
      if (before[id][i] > 0 && after[id][i] > 0) {
        of_points.push_back(static_cast<float>(after[id][i] / before[id][i]));
      }
    }
    if (!of_points.empty()) ratios[id] = Median(std::move(of_points));
  }
  map.ScaleAround(ratios);
}

// The points that the old keyframe and its closest neighbours see.
std::vector<PointId> PointsAround(const Map& map, KeyframeId keyframe) {
  constexpr std::size_t kMaxNeighbours = 10;
  std::vector<KeyframeId> keyframes = {keyframe};
  for (const Covisible& other : map.CovisibleKeyframes(keyframe)) {
    if (keyframes.size() > kMaxNeighbours) break;
    keyframes.push_back(other.keyframe);
  }
  std::vector<PointId> points;
  std::vector<char> is_listed(map.points().size(), 0);
  for (const KeyframeId id : keyframes) {
    for (const std::optional<PointId>& point : map.keyframe(id).view.points) {
      if (!point || is_listed[*point] != 0) continue;
      is_listed[*point] = 1;
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
    if (!map.point(point).alive || map.FeatureOf(point, keyframe)) continue;
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
  for (const KeyframeId candidate : Candidates(map, index, keyframe)) {
    std::optional<PlaceFound> loop = MatchPlace(map, keyframe, map, candidate, seed);
    if (loop) return loop;
  }
  return std::nullopt;
}

void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
               MappingTurn& turn) {
  KeyframeGraph graph = BuildGraph(map);
  const Pose T_new_old = loop.T_cam_world * map.T_cam_world(loop.old_keyframe).Inverse();
  graph.AddLoop(loop.old_keyframe, loop.keyframe,
                Similarity(1 / loop.scale, Pose()) * Similarity(1, T_new_old));
  const double length = Median(map.Depths(map.keyframe(loop.keyframe).view));
  const KeyframeId num_keyframes = map.keyframes().size();
  const GraphConstraints constraints = ConstraintsOf(map, graph);
  {
    const WithoutMap away(turn);
    OptimisePoseGraph(graph.S_cam_world, graph.edges, length > 0 ? length : 1, constraints);
  }
  AddNewer(map, num_keyframes, loop.keyframe, graph);
  map.Correct(graph.keyframes, graph.S_cam_world);
  MergePlaces(map, loop, options, turn);
}

void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options,
                 MappingTurn& turn) {
  for (const auto& [own, old] : loop.same) {
    if (map.point(own).alive && map.point(old).alive) map.MergePoints(own, old);
  }
  // The newest keyframes see the old points as well: this is what holds both ends together.
  const std::vector<PointId> old_points = PointsAround(map, loop.old_keyframe);
  constexpr KeyframeId kNewest = 5;
  std::vector<KeyframeId> around = {loop.keyframe};
  for (const Covisible& other : map.CovisibleKeyframes(loop.keyframe)) {
    if (other.keyframe + kNewest >= loop.keyframe) around.push_back(other.keyframe);
  }
  for (const KeyframeId id : around) ShowPoints(map, old_points, id);
  // With more than new points are made with: the old keyframes share few points yet, and come last.
  LocalMappingOptions wider = options;
  wider.num_neighbours = std::max(options.num_neighbours, 6);
  for (const KeyframeId id : around) FusePoints(map, id, wider);
  if (!turn.IsShared()) AdjustMerged(map, turn);
}

bool AdjustMerged(Map& map, MappingTurn& turn) {
  const std::vector<std::vector<double>> before = DepthsByFeature(map);
  const bool is_done = AdjustAll(map, turn);
  NoteScales(before, map);
  return is_done;
}

}  // namespace mono3d::tracking
