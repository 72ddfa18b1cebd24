// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/constraint_following.h"

#include <cstddef>
#include <string>

#include "mono3d/core/log.h"
#include "mono3d/core/statistics.h"
#include "mono3d/image/keyframe.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/keyframe_graph.h"
#include "tracking/optimisation/map_adjustment.h"
#include "tracking/optimisation/map_constraints.h"

namespace mono3d::tracking {
namespace {

// Moves the map to where it agrees with the new constraint; false, and nothing moved, where it
// cannot. A wrong one bends the map, one that is left out only leaves it as it was: it may cost the
// graph what chance explains.
bool MoveTo(Map& map, const PresentConstraint& constraint, double contradiction,
            MappingLock& lock) {
  KeyframeGraph graph = BuildGraph(map, kMinReturnGap);
  GraphConstraints constraints = ConstraintsOf(map, graph);
  constraints.edges.push_back(EdgeOf(constraint, graph));
  constraints.edges.back().is_certain = true;
  const double length = UpperMedianOrZero(map.Depths(map.keyframe(constraint.keyframe).view));
  const KeyframeId num_keyframes = map.keyframes().size();
  PoseGraphReport report;
  {
    const ScopedUnlock away(lock);
    report =
        OptimisePoseGraph(graph.S_cam_world, graph.edges, length > 0 ? length : 1, constraints);
  }
  const double cost_without = report.initial_cost - contradiction;
  const bool is_credible = report.final_cost - cost_without <= kChi2SevenDofSure;
  Log(LogLevel::kInfo, "keyframe " + std::to_string(map.keyframe(constraint.keyframe).id) +
                           ": the model contradicts the map (chi2 " +
                           std::to_string(contradiction) + ", " +
                           std::to_string(report.final_cost - cost_without) + " in agreement), " +
                           (is_credible ? "which follows" : "which stays"));
  if (!is_credible) return false;
  AddNewer(map, num_keyframes, constraint.keyframe, graph);
  map.Correct(graph.keyframes, graph.S_cam_world);
  return true;
}

}  // namespace

bool FollowConstraints(Map& map, MappingLock& lock, bool adjusts) {
  bool has_moved = false;
  // More of them may come, at the end of the list, while the map is given up.
  for (std::size_t i = 0; i < map.constraints().size(); ++i) {
    if (!map.constraints()[i].is_new) continue;
    const PresentConstraint constraint = AtPresent(map, map.constraints()[i]);
    const double contradiction = Contradiction(map, constraint);
    const bool is_contradicted = contradiction > kChi2SevenDof;
    const bool is_kept = constraint.keyframe != constraint.anchor &&
                         (!is_contradicted || MoveTo(map, constraint, contradiction, lock));
    has_moved = has_moved || (is_kept && is_contradicted);
    if (is_kept) {
      map.constraints()[i].is_new = false;
    } else {
      map.constraints().erase(map.constraints().begin() + static_cast<std::ptrdiff_t>(i--));
    }
  }
  if (has_moved && adjusts && !lock.IsShared()) AdjustAllAndScales(map, lock);
  return has_moved;
}

}  // namespace mono3d::tracking
