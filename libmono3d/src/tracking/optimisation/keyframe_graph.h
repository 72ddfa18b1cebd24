// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tracking/map/map.h"
#include "tracking/optimisation/pose_graph.h"

namespace mono3d::tracking {

// The living keyframes of a map as a pose graph, and which node is which. All edges say what the
// map has now.
struct KeyframeGraph {
  std::vector<KeyframeId> keyframes;
  std::vector<std::optional<std::size_t>> node_of;
  std::vector<Similarity> S_cam_world;
  std::vector<SimilarityEdge> edges;

  void AddEdge(KeyframeId a, KeyframeId b, const Similarity& S_b_a) {
    edges.push_back({*node_of[a], *node_of[b], S_b_a});
  }
  // The edge of a loop; its weight is that of all edges at one of its ends together.
  void AddLoop(KeyframeId a, KeyframeId b, const Similarity& S_b_a);
};

// Points that two keyframes must share, so that their relative pose is well determined.
inline constexpr int kMinSharedOfEdge = 50;
// From so many keyframes apart in flight on, two that see the same points are taken for a return to
// the place, after which the tracker may have drifted. Closer ones see the same points all along:
// their pairs add no information beyond the edges from each keyframe to the next.
inline constexpr std::size_t kMinReturnGap = 10;

// Each with the one before it in flight, and with those with which it shares many points: of these
// only such as are at least `min_gap` keyframes away in flight.
KeyframeGraph BuildGraph(const Map& map, std::size_t min_gap = 0);

// Adds the keyframes that were added to the map while the graph was optimised: they keep their
// poses relative to `leader`.
void AddNewer(const Map& map, KeyframeId num_keyframes, KeyframeId leader, KeyframeGraph& graph);

}  // namespace mono3d::tracking
