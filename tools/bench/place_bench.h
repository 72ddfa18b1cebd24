// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "evaluate/evaluation.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/tracking/place_recognition.h"
#include "mono3d/tracking/tracker.h"
#include "report/table.h"

namespace mono3d::tools {

// How well the tracker knows places again: the first part of a sequence becomes a map, of which the
// images of the rest are asked where they were taken, and those of other sequences, which are
// elsewhere.
struct PlaceBenchOptions {
  std::string folder;               // of a sequence with true poses and depth
  std::vector<std::string> others;  // folders of sequences of other places
  int split = 0;                    // first image that is not for the map; 0: the middle one
  int query_stride = 4;             // every which image is asked for
  FrameSourceOptions source;        // its `start` and `max_frames` are not used
  TrackerOptions tracking;
};

// How much of what an image shows is in the map, by the truth: whether a keyframe of the map shows
// at least half of its surface too, seen from directions that differ by at most 10, 20 or 30
// degrees (a revisit), or less of it; or none of the keyframes shows any (another place).
enum class PlaceClass { kWithin10, kWithin20, kWithin30, kLess, kElsewhere };
inline constexpr int kNumRevisitClasses = 3;
const char* ToString(PlaceClass place_class);

// Images of one class and of one sequence.
struct PlaceCounts {
  std::string name;  // of the other sequence; empty: of the map's own
  PlaceClass place_class = PlaceClass::kElsewhere;
  int num_asked = 0;
  int num_proposed = 0;  // among the candidates is a keyframe that shows half of it within 30 deg
  int num_right = 0;     // a pose, right by the truth
  int num_wrong = 0;     // a pose, and not that
  double sum_squared_error = 0;  // of the right positions over the mean depth in the image
};

struct PlaceBenchResult {
  std::string name;
  std::int64_t split = 0;
  int num_keyframes = 0;               // of the map
  double map_rmse_m = 0;               // of its keyframes, aligned to the truth
  std::vector<PlaceCounts> images;     // asked for by a lost camera
  std::vector<PlaceCounts> keyframes;  // of a second map, as two maps are joined and loops closed
};

// Share of the revisits that have a right pose; nothing where there were none.
std::optional<double> Recall(const std::vector<PlaceCounts>& counts);
// Poses that are wrong.
int NumWrong(const std::vector<PlaceCounts>& counts);

// Throws Error where a sequence cannot be read, has no truth, or the first part gives no map.
PlaceBenchResult BenchPlaces(const PlaceBenchOptions& options);

std::vector<Table> ToTables(const PlaceBenchResult& result);
Json ToJson(const PlaceBenchResult& result);

}  // namespace mono3d::tools
