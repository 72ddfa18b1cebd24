// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/keyframe_graph.h"

#include <algorithm>

namespace mono3d::tracking {

KeyframeGraph BuildGraph(const Map& map, std::size_t min_gap) {
  KeyframeGraph graph;
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
  std::vector<std::size_t> place_of(map.keyframes().size());
  std::size_t num_places = 0;
  const std::vector<KeyframeId> in_order = map.InOrderOfFlight();
  for (const KeyframeId id : in_order) {
    if (map.keyframe(id).alive) place_of[id] = num_places++;
  }
  const auto gap = [&](KeyframeId a, KeyframeId b) {
    return std::max(place_of[a], place_of[b]) - std::min(place_of[a], place_of[b]);
  };
  for (const KeyframeId id : in_order) {
    if (!map.keyframe(id).alive) continue;
    // To the one before in any case, so that the graph is in one piece.
    if (before) graph.AddEdge(*before, id, relative(*before, id));
    for (const Covisible& other : map.CovisibleKeyframes(id)) {
      if (other.num_shared < kMinSharedOfEdge || other.keyframe >= id || other.keyframe == before ||
          gap(id, other.keyframe) < min_gap) {
        continue;
      }
      graph.AddEdge(other.keyframe, id, relative(other.keyframe, id));
    }
    before = id;
  }
  return graph;
}

void KeyframeGraph::AddLoop(KeyframeId a, KeyframeId b, const Similarity& S_b_a) {
  const auto num_at = [&](std::size_t node) {
    return std::count_if(edges.begin(), edges.end(), [&](const SimilarityEdge& edge) {
      return edge.a == node || edge.b == node;
    });
  };
  const auto weight = static_cast<double>(std::max(num_at(*node_of[a]), num_at(*node_of[b])));
  edges.push_back({*node_of[a], *node_of[b], S_b_a, weight});
}

void AddNewer(const Map& map, KeyframeId num_keyframes, KeyframeId leader, KeyframeGraph& graph) {
  for (KeyframeId id = num_keyframes; id < map.keyframes().size(); ++id) {
    const Pose T_new_leader = map.T_cam_world(id) * map.T_cam_world(leader).Inverse();
    graph.keyframes.push_back(id);
    graph.S_cam_world.push_back(Similarity(1, T_new_leader) *
                                graph.S_cam_world[*graph.node_of[leader]]);
  }
}

}  // namespace mono3d::tracking
