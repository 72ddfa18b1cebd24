// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <map>
#include <utility>

#include "mono3d/pipeline/stages.h"
#include "mono3d/tracking/tracker.h"
#include "pipeline/run_state.h"

namespace mono3d {

// Tells a tracker where the cameras of its maps were, by the positions of the run: as soon as they
// determine where a map is on the earth, and again each time that it has grown by half. So it costs
// no more than some shares of a last time, however long the run.
class PositionFeed {
 public:
  explicit PositionFeed(PipelinePositions positions) : positions_(std::move(positions)) {}

  // Has the map grown enough since the last time?
  bool IsDue(int map_id, std::size_t num_keyframes) const;
  // Counts as the last time, also where there is nothing to tell yet.
  void Give(int map_id, std::size_t num_keyframes, Tracker& tracker);

  template <typename Archive>
  void ExchangeState(Archive& archive) {
    ExchangeMap(
        archive, due_at_, [&](int& map_id) { archive.Number(map_id); },
        [&](std::size_t& num_keyframes) { archive.Index(num_keyframes); });
  }

 private:
  PipelinePositions positions_;
  std::map<int, std::size_t> due_at_;  // keyframes of each map
};

}  // namespace mono3d
