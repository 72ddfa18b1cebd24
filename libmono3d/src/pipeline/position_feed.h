// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/background_task.h"
#include "mono3d/pipeline/snapshot.h"
#include "mono3d/pipeline/stages.h"
#include "mono3d/tracking/tracker.h"
#include "pipeline/map_on_earth.h"
#include "pipeline/run_state.h"

namespace mono3d {

// Finds where the maps of a tracker are on the earth by the positions of the run, and tells the
// tracker where its cameras were: as soon as they determine that, and again each time that the map
// has grown by half. So it costs no more than some shares of a last time, however long the run.
// Live, maps are placed in between as well. Used by one thread, but for SetTrack and place.
class PositionFeed {
 public:
  PositionFeed(PipelinePositions positions, bool is_live)
      : positions_(std::move(positions)), is_live_(is_live) {}

  // Positions that have come since, with all those before.
  void SetTrack(PositionTrack track);

  // After a keyframe of the map.
  void Give(int map_id, std::size_t num_keyframes, Tracker& tracker);
  // At once. Counts as the last time, also where there is nothing to tell yet.
  void GiveNow(int map_id, std::size_t num_keyframes, Tracker& tracker);
  // Has the map grown enough since the last time?
  bool IsDue(int map_id, std::size_t num_keyframes) const;

  // The latest; null: not known yet.
  std::shared_ptr<const PlaceOfMap> place() const;

  template <typename Archive>
  void ExchangeState(Archive& archive) {
    ExchangeMap(
        archive, due_at_, [&](int& map_id) { archive.Number(map_id); },
        [&](std::size_t& num_keyframes) { archive.Index(num_keyframes); });
  }

 private:
  PipelinePositions Positions() const;
  MapReconstruction MapSoFar(int map_id, const PositionTrack& track, const Tracker& tracker) const;
  void NotePlace(int map_id, GeoreferenceResult result);
  void GiveInBackground(int map_id, std::size_t num_keyframes, Tracker& tracker);

  mutable std::mutex mutex_;
  PipelinePositions positions_;
  std::shared_ptr<const PlaceOfMap> place_;
  bool is_live_;
  std::map<int, std::size_t> due_at_;  // keyframes of each map
  bool has_looked_ = false;            // not since the run was restored

  struct Task {
    MapReconstruction map;  // its trajectories
    PipelinePositions positions;
  };
  struct Found {
    int map_id = 0;
    MapOnEarth on_earth;
  };
  bool is_followed_ = false;  // what is found in the background
  std::unique_ptr<BackgroundTask<Task, Found>> background_;
};

}  // namespace mono3d
