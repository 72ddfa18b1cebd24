// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/tracker.h"

#include "mono3d/core/error.h"
#include "tracking/monocular_tracker.h"
#include "tracking/scaling_tracker.h"

namespace mono3d {

SparseModel Tracker::Sparse(int /*map_id*/) const { return {}; }

std::string Tracker::SaveMap() const { throw Error("this tracker cannot save maps"); }

void Tracker::LoadMap(std::string_view /*bytes*/, const std::string& where) {
  throw Error(ErrorParts{
      .what = "this tracker cannot load maps", .where = where, .expected = {}, .found = {}});
}

std::string Tracker::SaveState(SavedImages /*images*/) const {
  throw Error("this tracker cannot save its state: a run with it cannot be resumed");
}

void Tracker::RestoreState(std::string_view /*bytes*/, const std::string& where,
                           const ImageOfFrame& /*images*/) {
  throw Error(ErrorParts{.what = "this tracker cannot restore a state: begin the run anew",
                         .where = where,
                         .expected = {},
                         .found = {}});
}

std::unique_ptr<Tracker> CreateTracker(const TrackerOptions& options, StageTimes* times) {
  return std::make_unique<tracking::ScalingTracker>(
      std::make_unique<tracking::MonocularTracker>(options, times), options.max_side_px);
}

}  // namespace mono3d
