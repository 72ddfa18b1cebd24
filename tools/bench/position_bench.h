// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/placed_path.h"
#include "bench/placement_bound.h"
#include "bench/position_draw.h"
#include "evaluate/evaluation.h"
#include "mono3d/tracking/tracker.h"
#include "report/table.h"

namespace mono3d::tools {

// Flights with truth are placed on the earth by positions that are drawn, each as a run of
// mono3d-reconstruct does it, but without depth maps; and what that is off by is set beside what
// the errors of the positions allow.
struct PositionBenchOptions {
  std::vector<std::string> sequences;  // folders with images, camera.yaml and groundtruth.txt
  std::string output;                  // folder for the positions that were drawn
  std::vector<std::string> kinds = kReceiverKinds;
  int num_draws = 2;  // for each sequence and kind
  int seed = 1;       // of the first draw
  PositionDrawOptions draw;
  double stretch_m = 100;  // for the local shape
  TrackerOptions tracking;
  // Whole runs, with depth, of the first draw of each sequence with stated positions; the models
  // are compared with the true cloud as they lie.
  bool with_models = false;
};

// A path that has been placed on the earth.
struct PlacedRun {
  std::string reason;  // why it has not; empty: it has
  // What the middle, the turn about the vertical, the scale and the clock offset are off by (the
  // other two turns are 0), and the standard deviations that are stated.
  PlacementVector error = PlacementVector::Zero();
  PlacementVector sigma = PlacementVector::Zero();
  PlacedPathError path;
  bool is_placed() const { return reason.empty(); }
};

// A model as it lies, against the true cloud.
struct PlacedModel {
  std::string reason;  // why there is none
  double ground_sample_m = 0;
  double median_m = 0;  // distances to the true surface
  double rmse_m = 0;
  double median_aligned_m = 0;  // the same once registered to it with scale
};

struct PositionRun {
  std::string sequence;
  std::string flight;  // the kind of the flight, where the sequence tells it
  std::string receiver;
  int seed = 0;
  PlacementVector bound = PlacementVector::Zero();          // standard deviations
  PlacementVector error_of_best = PlacementVector::Zero();  // see PlacementBound
  PlacedRun followed;                                       // the map has followed the positions
  PlacedRun rigid;                                          // the map as the images alone make it
  PlacedRun true_path;                                      // the true path, by the same positions
  double share_tracked = 0;
  std::optional<PlacedModel> model;
};

// Throws Error where a sequence cannot be read or has no truth.
std::vector<PositionRun> BenchPositions(const PositionBenchOptions& options,
                                        const std::function<void(const PositionRun&)>& on_run);

// Of runs of one kind of positions: root mean squares over what the bounds allow, and how often the
// truth lies within the standard deviation that was stated.
struct PlacementSummary {
  struct Quantity {
    double rms_error = 0;
    double rms_bound = 0;
    double over_bound = 0;            // root mean square of error over bound of each run
    double over_bound_of_best = 0;    // the same of PlacementBound::error_of_best
    double over_bound_true_path = 0;  // and of the true path
    int num_within_sigma = 0;
    int num = 0;  // errors: of the place two for each run
  };
  int num_runs = 0;
  int num_placed = 0;  // the others have no part in what follows
  Quantity scale, heading, place, height, clock;
  double median_clock_s = 0;  // of the absolute error
  double share_within_50_ms = 0;
  double local_alone_m = 0, local_m = 0;  // root mean squares of all runs
  int num_local_worse = 0;  // runs whose local shape is worse than that of the images alone
  double largest_alone_share = 0, largest_share = 0;  // of the path, medians
  double worst_share = 0;
};
PlacementSummary Summarise(const std::vector<PositionRun>& runs);

std::vector<Table> ToTables(const std::vector<PositionRun>& runs);
Json ToJson(const std::vector<PositionRun>& runs);

}  // namespace mono3d::tools
