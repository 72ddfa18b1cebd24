// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/pipeline/snapshot.h"

namespace mono3d {

// Brings what a second run says into the worlds of the run that it replaces.
class WorldContinuation {
 public:
  WorldContinuation() = default;  // changes nothing

  // From the frames that both have tracked. Each map of the new run is laid upon the old map with
  // which it has most frames in common, by their cameras' centres and axes, so that a straight
  // flight will do. A map with fewer than three such frames, or that has not moved, stays where it
  // is. `last_version`: of the old run's poses; those of the new one are counted from there.
  WorldContinuation(const std::vector<TrajectoryEntry>& old_run,
                    const std::vector<TrajectoryEntry>& new_run, std::uint64_t last_version);

  bool IsIdentity() const { return maps_.empty() && last_version_ == 0; }
  Similarity Of(int map_id) const;  // S_old_new
  // The old map that a map of the new run was laid upon; -1: none.
  int OldMapOf(int map_id) const;

  KeyframePosesPtr Moved(const KeyframePosesPtr& poses) const;  // null of null
  std::shared_ptr<const PlaceOfMap> Moved(std::shared_ptr<const PlaceOfMap> place) const;
  void Move(PipelineSnapshot& snapshot) const;
  void Move(Reconstruction& reconstruction) const;
  // The online trajectories become what was known when the frames came: of frames before
  // `first_frame` the poses of the old run.
  void ContinueOnline(const std::vector<TrajectoryEntry>& old_run, std::int64_t first_frame,
                      Reconstruction& reconstruction) const;

 private:
  struct Laid {
    int old_map = 0;
    Similarity S_old_new;
  };
  std::map<int, Laid> maps_;  // by map of the new run
  std::uint64_t last_version_ = 0;
};

}  // namespace mono3d
