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
  // The edge of a loop: as firm as all those together that hold either of its ends.
  void AddLoop(KeyframeId a, KeyframeId b, const Similarity& S_b_a);
};

// Points that two keyframes share well: their poses to each other rest on them.
inline constexpr int kMinSharedOfEdge = 50;
// Keyframes in flight from which on two that see the same have come back to it, on a way that may
// have been wrong. Those in between see the same points and do not know each other better by every
// pair of them: so many in a row count once, one to the next.
inline constexpr std::size_t kMinReturnGap = 10;

// Each with the one before it in flight, and with those with which it shares many points: of these
// only such as are at least `min_gap` keyframes away in flight.
KeyframeGraph BuildGraph(const Map& map, std::size_t min_gap = 0);

// Keyframes that came while the graph was optimised are where they were to `leader`.
void AddNewer(const Map& map, KeyframeId num_keyframes, KeyframeId leader, KeyframeGraph& graph);

}  // namespace mono3d::tracking
