// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/loop_closing.h"

#include <algorithm>
#include <cmath>

#include "tracking/direct_tracking.h"
#include "tracking/frame_tracking.h"
#include "tracking/local_mapping.h"
#include "tracking/point_creation.h"
#include "tracking/pose_graph.h"

namespace mono3d::tracking {
namespace {

// The keyframes that share points with `keyframe`, or with one that does.
std::vector<char> ConnectedTo(const Map& map, KeyframeId keyframe) {
  constexpr int kMinShared = 15;
  std::vector<char> is_connected(map.keyframes().size(), 0);
  is_connected[keyframe] = 1;
  for (const Covisible& first : map.CovisibleKeyframes(keyframe)) {
    is_connected[first.keyframe] = 1;
    if (first.num_shared < kMinShared) continue;
    for (const Covisible& second : map.CovisibleKeyframes(first.keyframe)) {
      if (second.num_shared >= kMinShared) is_connected[second.keyframe] = 1;
    }
  }
  return is_connected;
}

std::vector<KeyframeId> Candidates(const Map& map, const PlaceIndex& index, KeyframeId keyframe) {
  constexpr std::size_t kMaxQueried = 40;
  constexpr std::size_t kMaxCandidates = 2;
  constexpr KeyframeId kMinAge = 10;  // keyframes: younger ones only lost sight for a moment
  const std::vector<char> is_connected = ConnectedTo(map, keyframe);
  std::vector<KeyframeId> candidates;
  const std::vector<Feature> features = FeaturesWithPoints(map.keyframe(keyframe).view);
  for (const PlaceMatch& match : index.Query(features, kMaxQueried)) {
    if (match.num_votes < kMinVotes || candidates.size() >= kMaxCandidates) break;
    if (is_connected[match.keyframe] != 0 || match.keyframe + kMinAge > keyframe) continue;
    if (map.keyframe(match.keyframe).alive) candidates.push_back(match.keyframe);
  }
  return candidates;
}

// The keyframes of a map as a graph, and which node is which.
struct Graph {
  std::vector<KeyframeId> keyframes;
  std::vector<std::optional<std::size_t>> node_of;
  std::vector<Similarity> S_cam_world;
  std::vector<SimilarityEdge> edges;

  void AddEdge(KeyframeId a, KeyframeId b, const Similarity& S_b_a) {
    edges.push_back({*node_of[a], *node_of[b], S_b_a});
  }
};

Graph BuildGraph(const Map& map) {
  constexpr int kMinShared = 50;  // points, for an edge
  Graph graph;
  graph.node_of.resize(map.keyframes().size());
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    if (!map.keyframe(id).alive) continue;
    graph.node_of[id] = graph.keyframes.size();
    graph.keyframes.push_back(id);
    graph.S_cam_world.emplace_back(1, map.T_cam_world(id));
  }
  const auto relative = [&](KeyframeId a, KeyframeId b) {
    return Similarity(1, map.T_cam_world(b) * map.T_cam_world(a).Inverse());
  };
  std::optional<KeyframeId> before;  // in flight
  for (const KeyframeId id : InOrderOfFlight(map)) {
    if (!map.keyframe(id).alive) continue;
    // To the one before in any case, so that the graph is in one piece.
    if (before) graph.AddEdge(*before, id, relative(*before, id));
    for (const Covisible& other : map.CovisibleKeyframes(id)) {
      if (other.num_shared < kMinShared || other.keyframe >= id || other.keyframe == before) {
        continue;
      }
      graph.AddEdge(other.keyframe, id, relative(other.keyframe, id));
    }
    before = id;
  }
  return graph;
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
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
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

}  // namespace

std::optional<PlaceFound> FindLoop(Map& map, const PlaceIndex& index, KeyframeId keyframe,
                                   int seed) {
  for (const KeyframeId candidate : Candidates(map, index, keyframe)) {
    std::optional<PlaceFound> loop = MatchPlace(map, keyframe, map, candidate, seed);
    if (loop) return loop;
  }
  return std::nullopt;
}

void CloseLoop(Map& map, const PlaceFound& loop, const LocalMappingOptions& options) {
  Graph graph = BuildGraph(map);
  const Pose T_new_old = loop.T_cam_world * map.T_cam_world(loop.old_keyframe).Inverse();
  graph.AddEdge(loop.old_keyframe, loop.keyframe,
                Similarity(1 / loop.scale, Pose()) * Similarity(1, T_new_old));
  const double length = Median(map.Depths(map.keyframe(loop.keyframe).view));
  OptimisePoseGraph(graph.S_cam_world, graph.edges, length > 0 ? length : 1);
  map.Correct(graph.keyframes, graph.S_cam_world);
  MergePlaces(map, loop, options);
}

void MergePlaces(Map& map, const PlaceFound& loop, const LocalMappingOptions& options) {
  for (const auto& [own, old] : loop.same) {
    if (map.point(own).alive && map.point(old).alive) map.MergePoints(own, old);
  }
  // The newest keyframes see the old points as well.
  std::vector<KeyframeId> around = {loop.keyframe};
  for (const Covisible& other : map.CovisibleKeyframes(loop.keyframe)) {
    constexpr KeyframeId kNewest = 5;
    if (other.keyframe + kNewest >= loop.keyframe) around.push_back(other.keyframe);
  }
  for (const KeyframeId id : around) FusePoints(map, id, options);
  const std::vector<std::vector<double>> before = DepthsByFeature(map);
  AdjustAll(map);
  NoteScales(before, map);
}

}  // namespace mono3d::tracking
